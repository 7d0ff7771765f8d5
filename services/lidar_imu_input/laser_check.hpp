// Whether a laser that scans in space sees the ground where its mounting says, and turns as it
// must.
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

/// The largest plane around the laser that is no wall.
struct GroundPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< Towards the sensor.
  double distance_m = 0.0;                            ///< Of the sensor.
};
/// The plane in points of one frame, the sensor at `sensor_m`; none where there is none with a
/// third of the points. Cost: about 0.1 ms.
std::optional<GroundPlane> find_ground(std::span<const Eigen::Vector3d> points_m,
                                       const Eigen::Vector3d& sensor_m);

/// What is wrong with the laser.
enum class LaserFault : std::uint8_t {
  kNone,
  kUpsideDown,    ///< The ground is above it.
  kTilted,        ///< The ground is tilted, on the mean over its way.
  kWrongHeight,   ///< The ground is nearer or farther than it is mounted: a height, or a unit.
  kTurnsOtherWay  ///< Its points come against the direction of lidar.turns.
};

/// The ground in frame vehicle is level and at height 0 on the mean over a way, whatever the slope:
/// the vehicle stands on it. One sweep shows a laser upside down; a way shows a tilt of some
/// degrees. The direction in which points come shows an axis or times that are turned round.
class LaserCheck {
 public:
  /// Mounting and direction of turning.
  explicit LaserCheck(const DeskewParameters& parameters) : parameters_(parameters) {}

  /// The points of a revolution in frame sensor, with times.
  void add_raw(const model::PointSweep& raw);
  /// The same in frame vehicle.
  void add(const model::PointSweep& sweep);
  /// The vehicle has moved so far, by any odometry.
  void travel(double way_m) { way_m_ += way_m; }

  LaserFault fault() const { return fault_; }
  /// For a person, with the setting that mends it; empty where nothing is wrong.
  std::string text() const;

  /// For saving and loading: what changes while it runs.
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
  double above_ = 0.0;  ///< Share of the latest planes that are above the sensor.
  double seen_ = 0.0;   ///< How many planes there were.
  double way_m_ = 0.0;  ///< Since the latest one of the mean.
  double count_ = 0.0;
  /// Of the normal's x and y, and of the distance less the mounting's height [m].
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares_ = Eigen::Vector3d::Zero();
};

}  // namespace understory::lidar_imu_input
