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

namespace understory::io {
namespace fs = std::filesystem;
namespace kitti {
namespace {

constexpr std::size_t kPointBytes = 16;

}  // namespace

model::PointSweep parse_points(std::string_view bytes, double revolution_s,
                               std::string_view source) {
  if (bytes.size() % kPointBytes != 0)
    throw DataError(
        fmt::format("{}: {} bytes are no whole points of {}", source, bytes.size(), kPointBytes));

  model::PointSweep sweep;
  sweep.rings = kitti::kRings;
  sweep.max_range_m = kitti::kMaxRange_m;
  sweep.points.reserve(bytes.size() / kPointBytes);
  int beam = 0;  // from the top
  float last = 0.0F;

  for (std::size_t at = 0; at < bytes.size(); at += kPointBytes) {
    std::array<float, 4> v{};
    std::memcpy(v.data(), bytes.data() + at, kPointBytes);
    model::SweepPoint point;
    point.x_m = v[0];
    point.y_m = v[1];
    point.z_m = v[2];
    point.intensity = static_cast<std::uint8_t>(std::clamp(v[3] * 255.0F, 0.0F, 255.0F));

    const float azimuth = std::atan2(v[1], v[0]);
    const float around = azimuth < 0.0F ? azimuth + 2.0F * std::numbers::pi_v<float> : azimuth;
    if (around < last - std::numbers::pi_v<float>) ++beam;
    last = around;
    point.ring = static_cast<std::uint16_t>(std::max(0, kitti::kRings - 1 - beam));

    // From behind the car, clockwise.
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

/// The stamp of each file: its name is the line's number. Drives may be cut, their stamps whole.
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
