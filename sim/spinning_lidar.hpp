// A rotating laser scanner: many beams, one above the other, over the full circle.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "sim/ray_caster.hpp"
#include "sim/vehicle_motion.hpp"
#include "sim/world.hpp"

namespace understory::sim {

/// Models with known elevations.
enum class LidarModel { kVlp16, kVlp32, kHdl32, kHdl64 };
/// Elevations of the beams, ascending [rad], from the makers' manuals.
std::vector<double> beam_elevations_rad(LidarModel model);

/// Geometry, rate and errors of the sensor.
struct LidarParameters {
  std::vector<double> elevations_rad = beam_elevations_rad(LidarModel::kVlp32);  ///< Ascending.
  int columns = 1800;  ///< Firings per revolution; all beams of a column fire at once.
  double revolutions_per_s = 10.0;
  bool clockwise = true;                        ///< Viewed from above, as Velodyne's rotate.
  double first_bearing_rad = std::numbers::pi;  ///< Frame `sensor`; start of a revolution.
  double range_sigma_m = 0.02;
  /// Half the width of a beam: a hit within it is reported on its axis.
  double beam_half_width_rad = 0.5e-3;
  double min_range_m = 0.8;
  double max_range_m = 100.0;
  double drop_out = 0.02;  ///< Share of returns lost by chance.
  /// Largest range at which half of the returns from a white, perpendicular surface are received;
  /// returns of dark and slanted ones are lost at a smaller range (proportional to the square root
  /// of the reflected share). 0 = no loss.
  double white_range_m = 220.0;
  Eigen::Isometry3d vehicle_T_sensor = Eigen::Isometry3d(Eigen::Translation3d(1.2, 0.0, 1.9));

  /// Duration of a revolution.
  double revolution_s() const { return 1.0 / revolutions_per_s; }
};

/// A revolution of the sensor, with the truth of every point.
struct SimulatedSweep {
  model::PointSweep raw;                ///< Frame `sensor`, skewed; utime of the first point.
  std::vector<ObjectId> objects;        ///< Object of each point.
  std::vector<Eigen::Vector3f> true_m;  ///< True position of the hit, frame `world`, without noise.
};

/// Pose of the vehicle in `world` at a time [s].
using PoseAt = std::function<Eigen::Isometry3d(double time_s)>;

/// A rotating LIDAR in a world.
class SpinningLidar {
 public:
  /// `world` must outlive the sensor and must not change.
  SpinningLidar(const World& world, LidarParameters parameters, std::uint64_t seed);

  /// Revolution number `revolution`, which begins at revolution * revolution_s() of the drive. Does
  /// not depend on earlier calls. `utime_of_start` is the utime of time 0.
  SimulatedSweep sweep(const VehicleMotion& motion, std::uint64_t revolution,
                       model::Utime utime_of_start = 0);
  /// Likewise for any motion.
  SimulatedSweep sweep(const PoseAt& world_T_vehicle, std::uint64_t revolution,
                       model::Utime utime_of_start = 0);
  /// Likewise for a vehicle that is stationary at `world_T_vehicle`.
  SimulatedSweep sweep_stationary(const Eigen::Isometry3d& world_T_vehicle,
                                  std::uint64_t revolution = 0);

  /// The parameters of the constructor.
  const LidarParameters& parameters() const { return parameters_; }

 private:
  void add_column(int column, double time_s, const Eigen::Isometry3d& world_T_vehicle,
                  std::uint64_t revolution, SimulatedSweep& sweep);
  void point_beams(const Eigen::Vector3d& ahead, const Eigen::Vector3d& up, std::uint64_t luck);
  bool is_lost(const RayHit& hit, double reflectivity, std::uint64_t luck) const;

  const World& world_;
  LidarParameters parameters_;
  std::uint64_t seed_;
  RayCaster caster_;
  std::vector<Eigen::Vector2d> beams_;  ///< Cosine and sine of each elevation.
  std::vector<Eigen::Vector3d> directions_;
  std::vector<RayHit> hits_;
};

}  // namespace understory::sim
