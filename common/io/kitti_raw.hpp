// A drive of the KITTI raw data: Velodyne HDL-64E sweeps and OXTS records with their time stamps.
//
// The .bin files contain only x, y, z, reflectance, beam by beam from the top, each from azimuth 0
// to the left. The beam is derived from the wraps of the azimuth, the time of a point from its
// azimuth: the laser rotates clockwise and starts behind the car. Sweeps are not corrected for the
// car's motion ("sync" and "extract" alike).
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "common/io/oxts.hpp"
#include "common/model/point_sweep.hpp"

namespace understory::io {

/// One drive: the names and times of its sweeps, read on demand, and all its OXTS records.
class KittiRaw {
 public:
  /// The folder of one drive (with velodyne_points/, oxts/); with the calibration, if any, in it or
  /// one folder up. Throws DataError.
  explicit KittiRaw(std::filesystem::path folder);

  /// Number of sweeps.
  std::size_t sweeps() const { return starts_.size(); }
  /// Frame sensor, skewed, with rings (0 = lowest) and times. Throws DataError.
  model::PointSweep read_sweep(std::size_t index) const;
  /// The OXTS records in order of time.
  const std::vector<OxtsRecord>& oxts() const { return oxts_; }
  /// Pose of the laser on the OXTS unit; none without calibration.
  const std::optional<Eigen::Isometry3d>& imu_T_velo() const { return imu_T_velo_; }

 private:
  std::filesystem::path folder_;
  std::vector<model::Utime> starts_;
  std::vector<model::Utime> ends_;
  std::vector<std::filesystem::path> files_;
  std::vector<OxtsRecord> oxts_;
  std::optional<Eigen::Isometry3d> imu_T_velo_;
};

namespace kitti {

constexpr double kMaxRange_m = 120.0;
constexpr std::uint16_t kRings = 64;

/// Frame `vehicle` is the OXTS unit's, seen from above. Value for 2011_09_26: the inverse of
/// calib_imu_to_velo.txt in the plane.
inline geometry::SE2 vehicle_T_laser() { return {0.8105, -0.3072, 0.00076}; }

/// Number of points (x, y, z, reflectance as float32) of a .bin file. Throws DataError.
std::size_t points_in(std::string_view bytes, std::string_view source);
/// Converts the bytes of a .bin file to points with rings and times within `revolution_s`. Throws
/// DataError.
model::PointSweep parse_points(std::string_view bytes, double revolution_s,
                               std::string_view source);
/// "R: ... T: ..." of calib_imu_to_velo.txt: velo_T_imu. Throws DataError.
Eigen::Isometry3d parse_transform(std::string_view text, std::string_view source);

}  // namespace kitti

/// The pose of one sweep of ReducedKitti, in the middle of its revolution.
struct ReducedKittiPose {
  model::Utime utime = 0;
  geometry::SE2 world_T_sensor;
};
/// Drive 0005 reduced to 16 of its 64 beams: sweeps.bin with poses beside it.
class ReducedKitti {
 public:
  /// A folder with sweeps.bin and poses_icp.csv or poses_oxts.csv (`poses`: "icp", "oxts"). Throws
  /// DataError.
  ReducedKitti(const std::filesystem::path& folder, std::string_view poses);
  /// Number of sweeps.
  std::size_t sweeps() const { return offsets_.size(); }
  /// Frame sensor; times from the azimuth, revolutions of 0.1 s; the pose's time is the middle.
  model::PointSweep read_sweep(std::size_t index) const;
  /// One pose per sweep, by index.
  const std::vector<ReducedKittiPose>& poses() const { return poses_; }

 private:
  std::string bytes_;
  std::string source_;
  std::vector<std::size_t> offsets_;
  std::vector<ReducedKittiPose> poses_;
};

}  // namespace understory::io
