// A scene and a path recorded in it.
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

/// The recorded motion of a body, for replay in every copy of the scene (thesis on existence, *Path
/// Recording*). Five coordinates are free: x, y, z, yaw and pitch. Roll is not: it is 0 in rooms;
/// in a forest ground and suspension determine it, as well as z and pitch.
struct RecordedPath {
  double step_s = 0.02;  ///< Between poses.
  /// (x, y, z, roll, pitch, yaw) in `world` [m, rad], yaw unwrapped.
  std::vector<UniformSpline<6>::Vector> poses;

  /// The motion, for the simulated sensors.
  VehicleMotion replay() const { return VehicleMotion::replayed(poses, step_s); }
  /// Positions, at most about `spacing_m` apart.
  std::vector<Eigen::Vector3d> places_m(double spacing_m) const;
};

/// A scene, a path, and its route in the plan.
struct Course {
  Scene scene;
  RecordedPath path;
  Route route;
};

/// Size of a course. 0: the scene's default.
struct CourseParameters {
  int laps = 1;
  double speed_mps = 0.0;                  ///< 0: 0.5 m/s in rooms, 2 m/s in the forest.
  double standstill_s = 3.0;               ///< At the start, for the calibration of an IMU.
  double length_m = 150.0;                 ///< Forest: circumference of the circular path.
  double margin_m = 40.0;                  ///< Forest around the path.
  ForestKind forest = ForestKind::kDense;  ///< A camera has several trunks in view.
};

/// A forest with parked cars and piles of logs, an office, or a module of a space station, and a
/// path through it; the same for the same arguments. Throws std::runtime_error if the parameters
/// allow no path.
Course make_course(SceneKind kind, const CourseParameters& parameters, std::uint64_t seed);

}  // namespace understory::sim::changes
