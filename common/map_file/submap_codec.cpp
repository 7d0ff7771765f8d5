#include "common/map_file/submap_codec.hpp"

#include <zlib.h>

#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>

#include "common/model/archive.hpp"

namespace understory::map_file {
namespace {

constexpr state::Format kKeyframes{"map_file.keyframes", 1};
constexpr double kCornerStep_m = 1e-2;
/// zlib packs at most this many bytes into one; a larger stated length is damage.
constexpr std::uint64_t kMostPerByte = 1040;
constexpr unsigned kGroupBits = 7;
constexpr unsigned kMostShift = 63;

/// Whole numbers, small ones in few bytes (seven bits each, the lowest first).
class NumberWriter {
 public:
  void add(std::uint64_t value) {
    for (; value > 0x7FU; value >>= kGroupBits)
      bytes_.push_back(static_cast<char>((value & 0x7FU) | 0x80U));
    bytes_.push_back(static_cast<char>(value));
  }
  void add_signed(std::int64_t value) {
    const auto bits = static_cast<std::uint64_t>(value);
    add((bits << 1U) ^ (value < 0 ? ~std::uint64_t{0} : 0));
  }
  /// Adds a value in integer steps.
  void add_steps(double value, double step) {
    add_signed(static_cast<std::int64_t>(std::llround(value / step)));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads numbers while there are bytes; beyond the end every number is 0 and is_whole() is false.
class NumberReader {
 public:
  explicit NumberReader(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t next() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift <= kMostShift; shift += kGroupBits) {
      if (bytes_.empty()) break;
      const auto byte = static_cast<std::uint8_t>(bytes_.front());
      bytes_.remove_prefix(1);
      value |= (byte & std::uint64_t{0x7F}) << shift;
      if ((byte & 0x80U) == 0) return value;
    }
    is_whole_ = false;
    return 0;
  }
  std::int64_t next_signed() {
    const std::uint64_t value = next();
    return static_cast<std::int64_t>((value >> 1U) ^ (~(value & 1U) + 1U));
  }
  double next_steps(double step) { return static_cast<double>(next_signed()) * step; }
  std::size_t left() const { return bytes_.size(); }
  bool is_whole() const { return is_whole_; }
  /// Whether all bytes were read and none was missing.
  bool is_done() const { return is_whole_ && bytes_.empty(); }

 private:
  std::string_view bytes_;
  bool is_whole_ = true;
};

/// Adds the lower triangle of the Cholesky factor; an entry that would round to zero becomes one
/// step.
void add_covariance(const Eigen::Matrix2d& covariance, NumberWriter& out) {
  const double xx = std::sqrt(std::max(0.0, covariance(0, 0)));
  const double xy = xx > 0.0 ? 0.5 * (covariance(0, 1) + covariance(1, 0)) / xx : 0.0;
  const double yy = std::sqrt(std::max(0.0, covariance(1, 1) - xy * xy));
  const bool is_known = !covariance.isZero(0.0);
  const auto at_least_a_step = [&](double value) {
    return is_known ? std::max(value, kSigmaStep_m) : 0.0;
  };
  out.add_steps(at_least_a_step(xx), kSigmaStep_m);
  out.add_steps(xy, kSigmaStep_m);
  out.add_steps(at_least_a_step(yy), kSigmaStep_m);
}

Eigen::Matrix2d next_covariance(NumberReader& in) {
  Eigen::Matrix2d factor = Eigen::Matrix2d::Zero();
  factor(0, 0) = in.next_steps(kSigmaStep_m);
  factor(1, 0) = in.next_steps(kSigmaStep_m);
  factor(1, 1) = in.next_steps(kSigmaStep_m);
  return factor * factor.transpose();
}

std::vector<std::uint8_t> as_bytes(std::string_view text) { return {text.begin(), text.end()}; }

std::string_view as_text(Blob bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::vector<std::uint8_t> packed(std::string_view bytes) {
  NumberWriter length;
  length.add(bytes.size());
  std::vector<std::uint8_t> result = as_bytes(length.bytes());

  uLongf size = ::compressBound(bytes.size());
  const std::size_t head = result.size();
  result.resize(head + size);
  static constexpr Bytef kNone = 0;
  const auto* const from = bytes.empty() ? &kNone : reinterpret_cast<const Bytef*>(bytes.data());
  if (::compress2(result.data() + head, &size, from, bytes.size(), Z_DEFAULT_COMPRESSION) != Z_OK)
    throw std::bad_alloc();
  result.resize(head + size);
  return result;
}

std::optional<std::string> unpacked(Blob bytes) {
  NumberReader reader(as_text(bytes));
  const std::uint64_t size = reader.next();
  if (!reader.is_whole() || size > kMostPerByte * (reader.left() + 1) ||
      size > std::numeric_limits<std::int32_t>::max())
    return std::nullopt;

  std::string result(size + 1, '\0');
  uLongf length = result.size();
  const Blob body = bytes.subspan(bytes.size() - reader.left());
  if (::uncompress(reinterpret_cast<Bytef*>(result.data()), &length, body.data(), body.size()) !=
          Z_OK ||
      length != size)
    return std::nullopt;
  result.resize(size);
  return result;
}

std::vector<std::uint8_t> landmark_bytes(std::span<const model::MapLandmark> landmarks) {
  NumberWriter out;
  out.add(landmarks.size());
  model::LandmarkId last = 0;
  for (const model::MapLandmark& one : landmarks) {
    out.add_signed(static_cast<std::int64_t>(one.id - last));
    last = one.id;
    out.add_steps(one.position_m.x(), kLandmarkStep_m);
    out.add_steps(one.position_m.y(), kLandmarkStep_m);
    add_covariance(one.covariance_m2, out);
    out.add_steps(one.radius_m, kLandmarkStep_m);
    const bool is_corner = one.kind == model::LandmarkKind::kCorner;
    out.add((std::uint64_t{one.observation_count} << 1U) | (is_corner ? 1U : 0U));
  }
  return packed(out.bytes());
}

std::optional<std::vector<model::MapLandmark>> landmarks_in(Blob bytes) {
  const auto text = unpacked(bytes);
  if (!text) return std::nullopt;
  NumberReader in(*text);
  const std::uint64_t count = in.next();
  if (count > in.left()) return std::nullopt;

  std::vector<model::MapLandmark> landmarks(count);
  model::LandmarkId last = 0;
  for (model::MapLandmark& one : landmarks) {
    one.id = last += static_cast<model::LandmarkId>(in.next_signed());
    one.position_m.x() = in.next_steps(kLandmarkStep_m);
    one.position_m.y() = in.next_steps(kLandmarkStep_m);
    one.covariance_m2 = next_covariance(in);
    one.radius_m = in.next_steps(kLandmarkStep_m);
    const std::uint64_t seen = in.next();
    one.observation_count = static_cast<std::uint32_t>(seen >> 1U);
    one.kind = (seen & 1U) != 0 ? model::LandmarkKind::kCorner : model::LandmarkKind::kTrunk;
  }
  if (!in.is_done()) return std::nullopt;
  return landmarks;
}

std::vector<std::uint8_t> keyframe_bytes(const std::vector<model::KeyframePose>& keyframes) {
  return packed(state::save(kKeyframes, keyframes));
}

std::optional<std::vector<model::KeyframePose>> keyframes_in(Blob bytes) {
  const auto text = unpacked(bytes);
  if (!text) return std::nullopt;
  try {
    std::vector<model::KeyframePose> keyframes;
    state::load(*text, kKeyframes, keyframes);
    return keyframes;
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

std::vector<std::uint8_t> id_bytes(std::span<const model::SubmapId> ids) {
  NumberWriter out;
  for (const model::SubmapId id : ids) out.add(id);
  return as_bytes(out.bytes());
}

std::optional<std::vector<model::SubmapId>> ids_in(Blob bytes) {
  NumberReader in(as_text(bytes));
  std::vector<model::SubmapId> ids;
  while (in.is_whole() && in.left() > 0) ids.push_back(in.next());
  if (!in.is_whole()) return std::nullopt;
  return ids;
}

std::vector<std::uint8_t> border_bytes(std::span<const Eigen::Vector2d> corners_m) {
  NumberWriter out;
  for (const Eigen::Vector2d& corner : corners_m) {
    out.add_steps(corner.x(), kCornerStep_m);
    out.add_steps(corner.y(), kCornerStep_m);
  }
  return as_bytes(out.bytes());
}

std::optional<std::vector<Eigen::Vector2d>> border_in(Blob bytes) {
  NumberReader in(as_text(bytes));
  std::vector<Eigen::Vector2d> corners;
  while (in.is_whole() && in.left() > 0) {
    const double x = in.next_steps(kCornerStep_m);
    corners.emplace_back(x, in.next_steps(kCornerStep_m));
  }
  if (!in.is_whole() || corners.size() < 3) return std::nullopt;
  return corners;
}

}  // namespace understory::map_file
