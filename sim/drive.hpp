// A simulated drive: a forest, a path in it, the robot's observations, and the truth.
#pragma once

#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"
#include "sim/forest.hpp"
#include "sim/path.hpp"
#include "sim/point_grid.hpp"
#include "sim/shared_errors.hpp"

namespace understory::sim {

/// An ideal landmark sensor; symbols and defaults as in GeoSLAM §4.5.
struct SensorParameters {
  double range_m = 40.0;
  double detection_probability = 0.9;  ///< [kappa] Of every landmark in range, independently.
  double position_sigma_m = 0.2;       ///< [epsilon] Per axis: independent.
  double stated_factor =
      1.0;  ///< Stated sigma divided by the true one: in practice the true one is unknown.
  /// Least stated variance of a detection [m^2]: also without noise it must not be zero.
  double variance_floor_m2 = 1e-8;
  double view_rad = 2.0 * std::numbers::pi;  ///< Width of the field of view, centred ahead.
  SharedErrorParameters shared;  ///< Additional errors common to several scans; not included in the
                                 ///< stated covariance.

  /// Farther landmarks are never detected: noise moves some from outside into range, up to 6 sigma.
  double reach_m() const { return range_m + 6.0 * position_sigma_m; }
};

/// Errors of wheel odometry from scan to scan. Sigmas are standard deviations.
struct WheelOdometryParameters {
  double distance_share = 0.01;  ///< Of a translation per axis, as a share of its length.
  double heading_walk = 0.003;   ///< Of a rotation [rad per square root of a metre].
  double turn_share = 0.02;      ///< Of a rotation, as a share of it.
};

/// One scan with truth that the mapper must not get.
struct SimulatedScan {
  model::LandmarkScan scan;
  geometry::SE2 world_T_vehicle;
  std::vector<std::uint32_t> trunks;  ///< Index of the trunk of each detection.
};

/// The shared errors of a drive, at one scan.
struct SharedErrorsAt {
  const SharedErrors* errors = nullptr;  ///< Null: none.
  double along_m = 0.0;                  ///< Distance travelled up to the scan.
};

/// All trunks in range of the pose, each detected at random, with a noisy position; the noise is
/// added before the test of the field of view (as in the code published with GeoSLAM). In random
/// order.
SimulatedScan observe(const Forest& forest, const PointGrid& grid,
                      const geometry::SE2& world_T_vehicle, const SensorParameters& sensor,
                      std::mt19937_64& random, const SharedErrorsAt& shared = {});

/// Requirements on a start pose.
struct StartPoseParameters {
  double clearance_m = 0.3;  ///< Least distance of trunks from the path.
  double margin_m = 40.0;    ///< Of forest around the whole path.
  int tries = 20000;
};
/// A start pose in the central half of the forest, with uniform heading, for which the path
/// (vehicle poses in the frame of the first) is free of trunks and inside the forest. None if all
/// tries failed.
std::optional<geometry::SE2> draw_start_pose(const Forest& forest, const PointGrid& grid,
                                             const std::vector<geometry::SE2>& path,
                                             const StartPoseParameters& parameters,
                                             std::mt19937_64& random);

/// All parameters of a simulated drive except its seed.
struct DriveParameters {
  ForestParameters forest;
  PathParameters path;
  SensorParameters sensor;
  StartPoseParameters start;
  double speed_mps = 1.0;  ///< Determines the stamps: interval / speed between scans.
  /// Trunks too near to the path are felled instead of drawing another start: a long path always
  /// meets some. The forest is then also enlarged to contain the path.
  bool clear_the_path = false;
  /// The forest is thinned until scans have this number of trunks in view on average, before random
  /// misses; 0 = not thinned.
  double trunks_in_view = 0.0;
  WheelOdometryParameters wheels;
};

/// Scans are made when asked for, each from a stream of its own: a drive of any length costs no
/// memory, and scan k is the same whichever were asked for before.
class Drive {
 public:
  /// A forest, a path and a start pose from `seed`. Throws std::runtime_error if the path does not
  /// fit.
  Drive(const DriveParameters& parameters, std::uint64_t seed);
  /// The same in a given forest (`parameters.forest` is not used).
  Drive(const DriveParameters& parameters, Forest forest, std::uint64_t seed);

  /// Number of scans.
  std::size_t size() const { return world_T_vehicle_.size(); }
  /// Scan k with its truth; the same at every call. Precondition: k < size().
  SimulatedScan scan(std::size_t k) const;
  /// Wheel measurement from scan k - 1 to scan k; the same at every call. Precondition: 0 < k <
  /// size().
  model::Odometry odometry(std::size_t k) const;
  /// Stamp of scan k [us].
  model::Utime utime(std::size_t k) const;

  /// The forest of the drive, without felled trunks.
  const Forest& forest() const { return forest_; }
  /// The forest's trunks, for queries by position.
  const PointGrid& grid() const { return *grid_; }
  /// The true pose at every scan.
  const std::vector<geometry::SE2>& world_T_vehicle() const { return world_T_vehicle_; }
  /// Distance travelled up to scan k [m].
  double along_m(std::size_t k) const { return along_m_[k]; }
  /// Largest distance from the sensor of a trunk that may be detected [m]: errors move some into
  /// range.
  double reach_m() const;
  /// The parameters in use (the forest may have been enlarged for the path).
  const DriveParameters& parameters() const { return parameters_; }

 private:
  void place_path();
  void fell_trunks_on(const std::vector<geometry::SE2>& path);
  void measure_path();

  DriveParameters parameters_;
  std::uint64_t seed_ = 0;
  SharedErrors shared_;
  Forest forest_;
  std::unique_ptr<PointGrid> grid_;
  std::vector<geometry::SE2> world_T_vehicle_;
  std::vector<double> along_m_;
};

}  // namespace understory::sim
