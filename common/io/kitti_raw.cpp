#include "common/io/kitti_raw.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>

#include "common/io/data_error.hpp"
#include "common/io/date_time.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"
#include "common/io/ring_finder.hpp"

namespace understory::io {
namespace fs = std::filesystem;
namespace kitti {
namespace {

constexpr std::size_t kPointBytes = 16;

}  // namespace

std::size_t points_in(std::string_view bytes, std::string_view source) {
  if (bytes.size() % kPointBytes != 0)
    throw DataError(fmt::format("{}: {} bytes are no whole points of {} (x, y, z, intensity)",
                                source, bytes.size(), kPointBytes));
  return bytes.size() / kPointBytes;
}

model::PointSweep parse_points(std::string_view bytes, double revolution_s,
                               std::string_view source) {
  std::vector<Eigen::Vector3f> positions(points_in(bytes, source));
  std::vector<float> reflectances(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    std::memcpy(positions[i].data(), bytes.data() + kPointBytes * i, 3 * sizeof(float));
    std::memcpy(&reflectances[i], bytes.data() + kPointBytes * i + 3 * sizeof(float),
                sizeof(float));
  }
  // Beams start ahead and turn left, the highest first.
  const RingTurns beams = find_turns(positions, 0.0);
  if (beams.turn.size() != positions.size())
    throw DataError(fmt::format("{}: its points are not ring after ring", source));

  model::PointSweep sweep;
  sweep.rings = kitti::kRings;
  sweep.max_range_m = kitti::kMaxRange_m;
  sweep.points.reserve(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    model::SweepPoint point;
    point.x_m = positions[i].x();
    point.y_m = positions[i].y();
    point.z_m = positions[i].z();
    point.intensity = static_cast<std::uint8_t>(std::clamp(reflectances[i] * 255.0F, 0.0F, 255.0F));
    point.ring = static_cast<std::uint16_t>(
        std::max(0, kitti::kRings - 1 - static_cast<int>(beams.turn[i])));

    // Azimuth from behind the car, clockwise.
    const float azimuth = std::atan2(point.y_m, point.x_m);
    point.time_s =
        static_cast<float>(revolution_s) * 0.5F * (1.0F - azimuth / std::numbers::pi_v<float>);
    if (std::isfinite(point.time_s)) sweep.points.push_back(point);
  }

  std::ranges::stable_sort(sweep.points,
                           [](const model::SweepPoint& a, const model::SweepPoint& b) {
                             return a.time_s != b.time_s ? a.time_s < b.time_s : a.ring < b.ring;
                           });

  return sweep;
}

Eigen::Isometry3d parse_transform(std::string_view text, std::string_view source) {
  const auto values = [&](std::string_view key, double* out, std::size_t count) {
    const std::size_t at = text.find(key);
    if (at == std::string_view::npos) throw DataError(fmt::format("{}: no line {}", source, key));
    const std::string_view rest = text.substr(at + key.size());
    NumberReader reader(rest.substr(0, rest.find('\n')), std::string(source));
    for (std::size_t i = 0; i < count; ++i) out[i] = reader.require(key);
  };

  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation;
  Eigen::Vector3d translation;
  values("\nR:", rotation.data(), 9);
  values("\nT:", translation.data(), 3);
  if ((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-3)
    throw DataError(fmt::format("{}: R is no rotation", source));

  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = Eigen::Quaterniond(Eigen::Matrix3d(rotation)).normalized().matrix();
  transform.translation() = translation;

  return transform;
}

}  // namespace kitti

namespace {

/// The files of a folder in order of their names.
std::vector<fs::path> files_of(const fs::path& folder, std::string_view extension) {
  std::vector<fs::path> files;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    const fs::path& path = entry.path();
    const std::string stem = path.stem().string();
    const bool numbered =
        !stem.empty() && stem.find_first_not_of("0123456789") == std::string::npos;
    if (numbered && path.extension() == extension) files.push_back(path);
  }
  if (failed) throw DataError(fmt::format("{}: {}", folder.string(), failed.message()));
  std::ranges::sort(files);
  return files;
}

std::vector<model::Utime> stamps_of(const RecordingFolder& folder, std::string_view name) {
  return parse_date_times(folder.read(name), folder.describe(name));
}

/// The stamp of each file, whose name is the line's number. Drives may lack files and still have
/// all stamps.
std::vector<model::Utime> pick_stamps(const std::vector<fs::path>& files,
                                      const std::vector<model::Utime>& stamps,
                                      const fs::path& folder) {
  if (files.empty()) throw DataError(fmt::format("{}: no numbered files", folder.string()));
  std::vector<model::Utime> picked;
  for (const fs::path& file : files) {
    const std::string stem = file.stem().string();
    std::size_t index = stamps.size();
    std::from_chars(stem.data(), stem.data() + stem.size(), index);
    if (index >= stamps.size())
      throw DataError(fmt::format("{}: no time stamp, there are {}", file.string(), stamps.size()));
    picked.push_back(stamps[index]);
  }
  return picked;
}

std::string read_whole(const fs::path& path) {
  return RecordingFolder(path.parent_path()).read(path.filename().string());
}

}  // namespace

KittiRaw::KittiRaw(fs::path folder) : folder_(std::move(folder)) {
  const fs::path laser = folder_ / "velodyne_points";
  const RecordingFolder stamps(laser);
  files_ = files_of(laser / "data", ".bin");
  starts_ = pick_stamps(files_, stamps_of(stamps, "timestamps_start.txt"), laser);
  ends_ = pick_stamps(files_, stamps_of(stamps, "timestamps_end.txt"), laser);

  // The published sets keep the records in oxts/data, reduced ones in oxts itself.
  const fs::path oxts = folder_ / "oxts";
  std::error_code failed;
  const fs::path data = fs::is_directory(oxts / "data", failed) ? oxts / "data" : oxts;
  if (fs::is_directory(oxts, failed)) {
    const std::vector<fs::path> records = files_of(data, ".txt");
    const std::vector<model::Utime> times =
        pick_stamps(records, stamps_of(RecordingFolder(oxts), "timestamps.txt"), oxts);
    for (std::size_t i = 0; i < records.size(); ++i) {
      oxts_.push_back(parse_oxts(read_whole(records[i]), records[i].string()));
      oxts_.back().utime = times[i];
    }
  }
  for (const fs::path& place : {folder_, folder_ / ".."}) {
    const fs::path file = place / "calib_imu_to_velo.txt";
    if (!fs::exists(file, failed)) continue;
    imu_T_velo_ = kitti::parse_transform(read_whole(file), file.string()).inverse();
    break;
  }
}

model::PointSweep KittiRaw::read_sweep(std::size_t index) const {
  const double revolution_s = static_cast<double>(ends_.at(index) - starts_.at(index)) * 1e-6;
  if (revolution_s <= 0.0 || revolution_s > 1.0)
    throw DataError(
        fmt::format("{}: revolution {} takes {} s", folder_.string(), index, revolution_s));
  model::PointSweep sweep =
      kitti::parse_points(read_whole(files_[index]), revolution_s, files_[index].string());
  sweep.utime = starts_[index];
  sweep.revolution = index;
  sweep.sequence = index;
  return sweep;
}

}  // namespace understory::io
