// One look at a map point.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace understory::existence {

/// Range measurement along the ray to the point, if the sensor has ranges.
enum class Ray : std::uint8_t {
  kUnknown,  ///< No range, or one at the point itself.
  kBlocked,  ///< A return clearly in front of the point: hidden by an obstacle.
  kPassed,   ///< A return clearly behind it: nothing on the ray.
};

/// One look at a point that is expected in view: within the field of view and the sensor's range.
struct Look {
  Eigen::Vector3f from_point_m;  ///< Sensor minus point, frame of the map.
  Ray ray = Ray::kUnknown;       ///< Read by miss() only.
  /// The point stays in its pass although the model has begun another one, because it has been in
  /// view since.
  bool goes_on = false;
};

/// Range along the ray against the point's distance, both [m]; `tolerance_m`: tolerance for the
/// errors of both.
inline Ray ray_of(double range_m, double distance_m, double tolerance_m) {
  if (range_m < distance_m - tolerance_m) return Ray::kBlocked;
  if (range_m > distance_m + tolerance_m) return Ray::kPassed;
  return Ray::kUnknown;
}

}  // namespace understory::existence
