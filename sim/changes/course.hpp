// A scene and the path that was recorded through it once.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sim/changes/scene.hpp"
#include "sim/forest.hpp"
#include "sim/route.hpp"
#include "sim/uniform_spline.hpp"
#include "sim/vehicle_motion.hpp"

namespace understory::sim::changes {

/// The motion of a body as it was driven once, to be replayed through every copy of the scene
/// (thesis on existence, *Path Recording*). Five coordinates are free: x, y, z, yaw and pitch. Roll
/// is not: it is 0 in rooms, and in a forest what ground and springs make of it, as are z and pitch
/// there.
struct RecordedPath {
  double step_s = 0.02;  ///< Between poses.
  /// (x, y, z, roll, pitch, yaw) in `world` [m, rad], yaw unwrapped.
  std::vector<UniformSpline<6>::Vector> poses;

  /// The motion, for the simulated sensors.
  VehicleMotion replay() const { return VehicleMotion::replayed(poses, step_s); }
  /// Places, at most about `spacing_m` apart.
  std::vector<Eigen::Vector3d> places_m(double spacing_m) const;
};

/// Scene, path, and where the path leads in the plan.
struct Course {
  Scene scene;
  RecordedPath path;
  Route route;
};

/// Size of a course. What is 0 has a value of its own in each scene.
struct CourseParameters {
  int laps = 1;
  double speed_mps = 0.0;                  ///< 0: 0.5 m/s in rooms, 2 m/s in the forest.
  double standstill_s = 3.0;               ///< At the start, where an IMU is calibrated.
  double length_m = 150.0;                 ///< Forest: circumference of the circle that is driven.
  double margin_m = 40.0;                  ///< Forest around it.
  ForestKind forest = ForestKind::kDense;  ///< Where a camera has several trunks in view.
};

/// A forest with parked cars and piles of logs, an office, or a module of a space station, and a
/// path through it; the same for the same arguments. Throws std::runtime_error where the parameters
/// leave no path.
Course make_course(SceneKind kind, const CourseParameters& parameters, std::uint64_t seed);

}  // namespace understory::sim::changes
