#include "services/landmark_extractor/planar/beams.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/se2.hpp"

namespace understory::landmark_extractor::planar {
namespace {

/// Largest distance of two neighbouring beams with returns, in steps.
constexpr double kNextBeam = 1.5;

/// Least time between two returns: the interval of beams, if any two are neighbours [s].
double beam_interval_s(const model::PointSweep& sweep) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < sweep.points.size(); ++i) {
    const double between = sweep.points[i].time_s - sweep.points[i - 1].time_s;
    if (between > 1e-7) least = std::min(least, between);
  }
  return least;
}

double median(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns, from the right to the left.
std::vector<Beam> returns_of(const model::PointSweep& sweep, const points::Spin& spin,
                             const Eigen::Matrix3d& level_R_vehicle) {
  const Eigen::Vector3d sensor = level_R_vehicle * sweep.sensor_position_m;
  const Eigen::Vector3d velocity =
      level_R_vehicle * Eigen::Vector3d(spin.velocity_mps.x(), spin.velocity_mps.y(), 0.0);
  std::vector<Beam> returns;
  const std::size_t count = sweep.points.size();
  for (std::size_t i = 0; i < count; ++i) {
    const model::SweepPoint& point = sweep.points[spin.is_leftward ? i : count - 1 - i];
    const Eigen::Vector3d p = level_R_vehicle * point.position().cast<double>();
    Beam beam;
    beam.origin_m = (sensor + point.time_s * velocity).head<2>();
    beam.point_m = p.head<2>();
    beam.z_m = p.z();
    beam.time_s = point.time_s;
    const Eigen::Vector2d offset = beam.point_m - beam.origin_m;
    beam.range_m = offset.norm();
    beam.bearing_rad = std::atan2(offset.y(), offset.x());
    if (!returns.empty()) {
      const double before = returns.back().bearing_rad;
      beam.bearing_rad = before + geometry::wrap_angle(beam.bearing_rad - before);
    }
    returns.push_back(beam);
  }
  return returns;
}

/// A beam without a return.
Beam silent(double bearing_rad) {
  Beam beam;
  beam.bearing_rad = bearing_rad;
  return beam;
}

/// Adds the last beam if it gave no return: the stamp is its time. The time of the first one is
/// unknown in a sweep.
void end_scan(const points::Spin& spin, double interval_s, Beams& scan) {
  if (scan.beams.empty()) return;
  const Beam& last = spin.is_leftward ? scan.beams.back() : scan.beams.front();
  const double steps = -last.time_s / interval_s;
  if (!(steps > kNextBeam)) return;
  if (spin.is_leftward) {
    scan.beams.push_back(silent(last.bearing_rad + steps * scan.step_rad));
  } else {
    scan.beams.insert(scan.beams.begin(), silent(last.bearing_rad - steps * scan.step_rad));
  }
}

}  // namespace

Beams beams_of(const model::PlanarScan& scan) {
  const geometry::SE2& vehicle_T_sensor = scan.vehicle_T_sensor;
  Beams result;
  result.step_rad = scan.bearing_step_rad;
  result.max_range_m = scan.max_range_m;
  result.sensor_m.head<2>() = vehicle_T_sensor.translation();
  for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
    Beam beam;
    beam.origin_m = vehicle_T_sensor.translation();
    beam.bearing_rad = vehicle_T_sensor.theta() + scan.bearing(i);
    if (scan.is_return(i)) beam.range_m = scan.ranges_m[i];
    beam.point_m = beam.origin_m + beam.range_m * Eigen::Vector2d(std::cos(beam.bearing_rad),
                                                                  std::sin(beam.bearing_rad));
    result.beams.push_back(beam);
  }
  return result;
}

Beams beams_of(const model::PointSweep& sweep, const points::Spin& spin) {
  const Eigen::Matrix3d level_R_vehicle = sweep.attitude
                                              ? sweep.attitude->level_Q_vehicle.toRotationMatrix()
                                              : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  Beams result;
  result.max_range_m = sweep.max_range_m;
  result.sensor_m = level_R_vehicle * sweep.sensor_position_m;
  const std::vector<Beam> returns = returns_of(sweep, spin, level_R_vehicle);
  const double interval_s = beam_interval_s(sweep);
  std::vector<double> steps;
  for (std::size_t i = 0; i < returns.size(); ++i) {
    if (i > 0 && std::abs(returns[i].time_s - returns[i - 1].time_s) < kNextBeam * interval_s) {
      steps.push_back(returns[i].bearing_rad - returns[i - 1].bearing_rad);
    } else if (i > 0) {
      const double between = 0.5 * (returns[i - 1].bearing_rad + returns[i].bearing_rad);
      result.beams.push_back(silent(between));
    }
    result.beams.push_back(returns[i]);
  }
  result.step_rad = median(steps);
  end_scan(spin, interval_s, result);
  return result;
}

}  // namespace understory::landmark_extractor::planar
