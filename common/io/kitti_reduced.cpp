#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "common/io/data_error.hpp"
#include "common/io/kitti_raw.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"

namespace understory::io {
namespace {

constexpr std::size_t kFrameHeaderBytes = 8;
constexpr std::size_t kPointBytes = 8;
constexpr double kTurn_s = 0.1;
constexpr model::Utime kStart_us = 1'000'000;  // the recording has no clock: no stamp is negative

std::uint32_t count_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i)
    value |= static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[at + i])) << (8U * i);
  return value;
}

float metres_at(const std::string& bytes, std::size_t at) {
  const auto low = static_cast<std::uint8_t>(bytes[at]);
  const auto high = static_cast<std::uint8_t>(bytes[at + 1]);
  return 0.01F * static_cast<float>(static_cast<std::int16_t>(low | (high << 8U)));
}

std::vector<ReducedKittiPose> parse_poses(std::string_view text, const std::string& source) {
  NumberReader reader(text, source);
  reader.skip_line();
  std::vector<ReducedKittiPose> poses;

  while (reader.next()) {
    const double t = reader.require("the time");
    std::array<double, 7> v{};
    for (double& value : v) value = reader.require("a coordinate of the pose");
    const Eigen::Quaterniond turn(v[6], v[3], v[4], v[5]);
    if (t < 0.0 || t > 1e6 || std::abs(turn.norm() - 1.0) > 1e-2)
      throw DataError(fmt::format("{}: no pose with time", reader.where()));
    const Eigen::Vector3d forward = turn.normalized() * Eigen::Vector3d::UnitX();
    poses.push_back({kStart_us + static_cast<model::Utime>(std::llround(t * 1e6)),
                     geometry::SE2(v[0], v[1], std::atan2(forward.y(), forward.x()))});
  }

  return poses;
}

}  // namespace

ReducedKitti::ReducedKitti(const std::filesystem::path& path, std::string_view poses) {
  const RecordingFolder folder(path);
  source_ = folder.describe("sweeps.bin");
  bytes_ = folder.read("sweeps.bin");
  const std::string name = fmt::format("poses_{}.csv", poses);
  poses_ = parse_poses(folder.read(name), folder.describe(name));
  std::size_t at = 0;

  while (at < bytes_.size()) {
    if (at + kFrameHeaderBytes > bytes_.size())
      throw DataError(fmt::format("{}: cut off at byte {}", source_, at));
    const std::size_t count = count_at(bytes_, at + 4);
    if (count_at(bytes_, at) != offsets_.size() ||
        count > (bytes_.size() - at - kFrameHeaderBytes) / kPointBytes)
      throw DataError(fmt::format("{}: no sweep {} at byte {}", source_, offsets_.size(), at));
    offsets_.push_back(at);
    at += kFrameHeaderBytes + count * kPointBytes;
  }

  if (offsets_.size() != poses_.size())
    throw DataError(
        fmt::format("{}: {} sweeps for {} poses", source_, offsets_.size(), poses_.size()));
}

model::PointSweep ReducedKitti::read_sweep(std::size_t index) const {
  model::PointSweep sweep;
  sweep.rings = 16;
  sweep.max_range_m = kitti::kMaxRange_m;
  sweep.revolution = index;
  sweep.sequence = index;
  sweep.utime = poses_[index].utime - static_cast<model::Utime>(0.5 * kTurn_s * 1e6);
  const std::size_t count = count_at(bytes_, offsets_[index] + 4);

  sweep.points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = offsets_[index] + kFrameHeaderBytes + i * kPointBytes;
    model::SweepPoint point;
    point.x_m = metres_at(bytes_, at);
    point.y_m = metres_at(bytes_, at + 2);
    point.z_m = metres_at(bytes_, at + 4);
    point.intensity = static_cast<std::uint8_t>(bytes_[at + 6]);
    const int from_top = std::min<int>(63, static_cast<std::uint8_t>(bytes_[at + 7]));

    point.ring = static_cast<std::uint16_t>((63 - from_top) / 4);
    const float azimuth = std::atan2(point.y_m, point.x_m);
    point.time_s =
        static_cast<float>(kTurn_s) * 0.5F * (1.0F - azimuth / std::numbers::pi_v<float>);
    sweep.points.push_back(point);
  }

  std::ranges::stable_sort(sweep.points,
                           [](const model::SweepPoint& a, const model::SweepPoint& b) {
                             return a.time_s != b.time_s ? a.time_s < b.time_s : a.ring < b.ring;
                           });

  return sweep;
}

}  // namespace understory::io
