#include "common/map_file/geometry_blob.hpp"

#include <array>
#include <bit>
#include <cstring>

namespace understory::map_file {
namespace {

constexpr std::uint8_t kLittleEndian = 1;
constexpr std::uint8_t kEnvelopeXy = 1U << 1U;
constexpr std::uint8_t kEmptyFlag = 1U << 4U;
/// Bytes of an envelope by its code: none, xy, xyz, xym, xyzm.
constexpr std::array<std::size_t, 5> kEnvelopeBytes{0, 32, 48, 48, 64};
constexpr std::size_t kPointBytes = 16;

class BlobWriter {
 public:
  template <class T>
  void add(T value) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(&value);
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes_.push_back(bytes[i]);
    static_assert(std::endian::native == std::endian::little);
  }
  void add(const Eigen::Vector2d& point) {
    add(point.x());
    add(point.y());
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Reads values while there are bytes; none beyond the end.
class BlobReader {
 public:
  explicit BlobReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  void set_little_endian(bool is_little) { is_little_ = is_little; }
  std::size_t left() const { return bytes_.size(); }
  bool skip(std::size_t count) {
    if (count > bytes_.size()) return false;
    bytes_ = bytes_.subspan(count);
    return true;
  }

  template <class T>
  std::optional<T> next() {
    std::array<std::uint8_t, sizeof(T)> raw{};
    if (bytes_.size() < raw.size()) return std::nullopt;
    for (std::size_t i = 0; i < raw.size(); ++i)
      raw[is_little_ ? i : raw.size() - 1 - i] = bytes_[i];
    skip(raw.size());
    return std::bit_cast<T>(raw);
  }

  std::optional<std::vector<Eigen::Vector2d>> points(std::size_t count) {
    if (count == 0 || count > left() / kPointBytes) return std::nullopt;
    std::vector<Eigen::Vector2d> points;
    points.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double x = *next<double>();
      points.emplace_back(x, *next<double>());
      if (!points.back().allFinite()) return std::nullopt;
    }
    return points;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool is_little_ = true;
};

/// Skips the header up to the well-known binary; false where there is none.
bool skip_header(BlobReader& reader) {
  const auto g = reader.next<std::uint8_t>();
  const auto p = reader.next<std::uint8_t>();
  const auto version = reader.next<std::uint8_t>();
  const auto flags = reader.next<std::uint8_t>();
  if (g != 'G' || p != 'P' || version != 0 || !flags) return false;

  const std::size_t envelope = (*flags >> 1U) & 7U;
  if ((*flags & kEmptyFlag) != 0 || envelope >= kEnvelopeBytes.size()) return false;
  return reader.skip(sizeof(std::int32_t) + kEnvelopeBytes[envelope]);
}

/// The corners of a polygon's single ring, which repeats its first corner in the bytes.
std::optional<std::vector<Eigen::Vector2d>> ring(BlobReader& reader) {
  if (reader.next<std::uint32_t>() != 1U) return std::nullopt;
  auto points = reader.points(reader.next<std::uint32_t>().value_or(0));
  if (!points || points->size() < 4 || points->front() != points->back()) return std::nullopt;
  points->pop_back();
  return points;
}

std::optional<std::vector<Eigen::Vector2d>> points_of(GeometryKind kind, BlobReader& reader) {
  switch (kind) {
    case GeometryKind::kPoint:
      return reader.points(1);
    case GeometryKind::kLine:
      return reader.points(reader.next<std::uint32_t>().value_or(0));
    case GeometryKind::kPolygon:
      return ring(reader);
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::uint8_t> geometry_blob(const Geometry& geometry, std::int32_t srs_id) {
  const bool is_point = geometry.kind == GeometryKind::kPoint;
  const bool is_polygon = geometry.kind == GeometryKind::kPolygon;
  BlobWriter out;
  for (const char c : {'G', 'P', '\0'}) out.add(c);
  out.add(static_cast<std::uint8_t>(kLittleEndian | (is_point ? 0U : kEnvelopeXy)));
  out.add(srs_id);

  if (!is_point) {
    const Box box = box_of(geometry);
    for (const double side : {box.low_m.x(), box.high_m.x(), box.low_m.y(), box.high_m.y()})
      out.add(side);
  }

  out.add(kLittleEndian);
  out.add(static_cast<std::uint32_t>(geometry.kind));
  const auto count = static_cast<std::uint32_t>(geometry.points_m.size());
  if (is_polygon) out.add(std::uint32_t{1});
  if (!is_point) out.add(is_polygon ? count + 1 : count);
  for (const Eigen::Vector2d& point : geometry.points_m) out.add(point);
  if (is_polygon) out.add(geometry.points_m.front());

  return out.take();
}

std::vector<std::uint8_t> point_blob(const Eigen::Vector2d& position_m, std::int32_t srs_id) {
  return geometry_blob({GeometryKind::kPoint, {position_m}}, srs_id);
}

std::optional<Geometry> geometry_of(std::span<const std::uint8_t> blob) {
  BlobReader reader(blob);
  if (!skip_header(reader)) return std::nullopt;
  const auto order = reader.next<std::uint8_t>();
  if (!order || *order > kLittleEndian) return std::nullopt;
  reader.set_little_endian(*order == kLittleEndian);

  const auto kind = reader.next<std::uint32_t>();
  if (!kind || *kind < 1 || *kind > 3) return std::nullopt;
  Geometry geometry{static_cast<GeometryKind>(*kind), {}};
  auto points = points_of(geometry.kind, reader);
  if (!points || reader.left() > 0) return std::nullopt;

  geometry.points_m = std::move(*points);
  return geometry;
}

Box box_of(const Geometry& geometry) {
  Box box{geometry.points_m.front(), geometry.points_m.front()};
  for (const Eigen::Vector2d& point : geometry.points_m) {
    box.low_m = box.low_m.cwiseMin(point);
    box.high_m = box.high_m.cwiseMax(point);
  }
  return box;
}

}  // namespace understory::map_file
