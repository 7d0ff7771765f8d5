// Checks a 3-D laser's mounting by the ground, and its direction of rotation.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// The largest plane around the laser that is not a wall.
struct GroundPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< Towards the sensor.
  double distance_m = 0.0;                            ///< Of the sensor.
};
/// The plane in points of one frame, the sensor at `sensor_m`; none if no plane contains a third of
/// the points. Cost: about 0.1 ms.
std::optional<GroundPlane> find_ground(std::span<const Eigen::Vector3d> points_m,
                                       const Eigen::Vector3d& sensor_m);

/// Fault of the laser.
enum class LaserFault : std::uint8_t {
  kNone,
  kUpsideDown,    ///< The ground is above it.
  kTilted,        ///< The mean ground along the path is tilted.
  kWrongHeight,   ///< The ground is nearer or farther than by the mounting: a wrong height or unit.
  kTurnsOtherWay  ///< The order of its points contradicts lidar.turns.
};

/// In frame vehicle the mean ground along the path is level and at height 0, on any slope: the
/// vehicle stands on it. One sweep is sufficient to detect a laser that is upside down; a tilt of
/// some degrees needs a path. The order of the points shows a reversed axis or reversed times.
class LaserCheck {
 public:
  /// `parameters`: mounting and direction of rotation.
  explicit LaserCheck(const DeskewParameters& parameters) : parameters_(parameters) {}

  /// Adds the points of a revolution in frame sensor, with times.
  void add_raw(const model::PointSweep& raw);
  /// Likewise in frame vehicle.
  void add(const model::PointSweep& sweep);
  /// Adds path length, by any odometry.
  void travel(double way_m) { way_m_ += way_m; }

  LaserFault fault() const { return fault_; }
  /// For a person, with the setting that corrects it; empty without a fault.
  std::string text() const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.fault_, self.turn_, self.above_, self.seen_, self.way_m_, self.count_, self.sum_,
      self.squares_);
  }

 private:
  void judge();

  DeskewParameters parameters_;
  LaserFault fault_ = LaserFault::kNone;
  double turn_ = 0.0;   ///< Mean direction, 1 = counterclockwise.
  double above_ = 0.0;  ///< Share of the latest planes above the sensor.
  double seen_ = 0.0;   ///< Number of planes.
  double way_m_ = 0.0;  ///< Since the latest plane of the mean.
  double count_ = 0.0;
  /// Sums of the normal's x and y, and of the distance minus the mounting's height [m].
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares_ = Eigen::Vector3d::Zero();
};

}  // namespace understory::lidar_imu_input
