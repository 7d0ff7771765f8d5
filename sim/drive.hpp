// A simulated drive: a forest, a path in it, what the robot observes on it, and the truth.
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
  double stated_factor = 1.0;  ///< Stated sigma by the true one: no deployment knows the true one.
  /// Least variance that a detection states [m^2]: a noise-free one must not be infinitely sure.
  double variance_floor_m2 = 1e-8;
  double view_rad = 2.0 * std::numbers::pi;  ///< Width of the field of view, its middle ahead.
  SharedErrorParameters shared;  ///< Errors on top, which scans share; what is stated counts none.

  /// Farther landmarks are never detected: noise brings some from outside into range, 6 sigma are
  /// enough.
  double reach_m() const { return range_m + 6.0 * position_sigma_m; }
};

/// Errors of wheel odometry from scan to scan. Sigmas are standard deviations.
struct WheelOdometryParameters {
  double distance_share = 0.01;  ///< Of a translation per axis, as a share of its length.
  double heading_walk = 0.003;   ///< Of a rotation [rad per square root of a metre].
  double turn_share = 0.02;      ///< Of a rotation, as a share of it.
};

/// One scan with the truth that a mapper must not get.
struct SimulatedScan {
  model::LandmarkScan scan;
  geometry::SE2 world_T_vehicle;
  std::vector<std::uint32_t> trunks;  ///< Index of the trunk behind each detection.
};

/// The errors that scans of a drive share, at one of them.
struct SharedErrorsAt {
  const SharedErrors* errors = nullptr;  ///< None where it is null.
  double along_m = 0.0;                  ///< Travelled up to the scan.
};

/// All trunks in range of the pose, each detected by chance, its position noisy; the noise comes
/// before the test of the field of view (as in the code published with GeoSLAM). In random order.
SimulatedScan observe(const Forest& forest, const PointGrid& grid,
                      const geometry::SE2& world_T_vehicle, const SensorParameters& sensor,
                      std::mt19937_64& random, const SharedErrorsAt& shared = {});

/// What a start pose has to keep clear of.
struct StartPoseParameters {
  double clearance_m = 0.3;  ///< No trunk nearer than this to the path.
  double margin_m = 40.0;    ///< Of forest around the whole path.
  int tries = 20000;
};
/// A start pose in the central half of the forest, heading uniform, from which the path
/// (vehicle poses in the frame of the first) keeps clear of all trunks and inside the forest.
/// None if no try succeeded.
std::optional<geometry::SE2> draw_start_pose(const Forest& forest, const PointGrid& grid,
                                             const std::vector<geometry::SE2>& path,
                                             const StartPoseParameters& parameters,
                                             std::mt19937_64& random);

/// Everything of a simulated drive but its seed.
struct DriveParameters {
  ForestParameters forest;
  PathParameters path;
  SensorParameters sensor;
  StartPoseParameters start;
  double speed_mps = 1.0;  ///< Gives the stamps: interval / speed between scans.
  /// Trunks too near to the path are felled instead of another start being drawn: a long path
  /// always meets some. The forest then also grows to hold the path.
  bool clear_the_path = false;
  /// The forest is thinned until scans have so many trunks in view on average, before chance takes
  /// some; 0 = as it is.
  double trunks_in_view = 0.0;
  WheelOdometryParameters wheels;
};

/// A laser with one plane that looks ahead and sees trunks up to 20 m, two or three in a scan of
/// every metre, each with 3 cm of noise.
DriveParameters few_landmarks_drive();

/// Scans are made when asked for, each from a stream of its own: a drive of any length costs no
/// memory, and scan k is the same whichever were asked for before.
class Drive {
 public:
  /// A forest, a path and a start pose from `seed`. Throws std::runtime_error where the path fits
  /// nowhere.
  Drive(const DriveParameters& parameters, std::uint64_t seed);
  /// The same in a given forest (`parameters.forest` is not used).
  Drive(const DriveParameters& parameters, Forest forest, std::uint64_t seed);

  /// Number of scans.
  std::size_t size() const { return world_T_vehicle_.size(); }
  /// Scan k with its truth; the same at every call. Precondition: k < size().
  SimulatedScan scan(std::size_t k) const;
  /// What wheels measure from scan k - 1 to scan k; the same at every call. Precondition: 0 < k <
  /// size().
  model::Odometry odometry(std::size_t k) const;
  /// Stamp of scan k [us].
  model::Utime utime(std::size_t k) const;

  /// The forest driven through, felled trunks left out.
  const Forest& forest() const { return forest_; }
  /// The forest's trunks, for queries by position.
  const PointGrid& grid() const { return *grid_; }
  /// The true pose at every scan.
  const std::vector<geometry::SE2>& world_T_vehicle() const { return world_T_vehicle_; }
  /// Distance travelled up to scan k [m].
  double along_m(std::size_t k) const { return along_m_[k]; }
  /// Distance from the sensor within which a trunk may be detected [m]: errors move some into
  /// range.
  double reach_m() const;
  /// The parameters in force (the forest may have grown to hold the path).
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
