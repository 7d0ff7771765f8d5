#include "services/lidar_imu_input/deskew.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "services/lidar_imu_input/attitude_filter.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr float kStep_s = 1e-3F;  // between exact poses; in between they are interpolated
constexpr float kLongestRevolution_s = 1.0F;

using Motion = Eigen::Matrix<float, 3, 4>;

/// target_T_sensor at steps of kStep_s over the revolution.
std::vector<Motion> motions(const model::PointSweep& raw, const MotionState& target,
                            const MotionHistory& history, const SensorMount& mount,
                            std::size_t steps) {
  const Eigen::Isometry3d vehicle_T_sensor = mount.vehicle_T_sensor();
  const auto pose = [](const MotionState& state) {
    Eigen::Isometry3d odom_T_vehicle = Eigen::Isometry3d::Identity();
    odom_T_vehicle.linear() = state.odom_Q_vehicle.toRotationMatrix();
    odom_T_vehicle.translation() = state.position_m;
    return odom_T_vehicle;
  };

  const Eigen::Isometry3d target_T_odom = pose(target).inverse();
  std::vector<Motion> result;
  result.reserve(steps);
  for (std::size_t i = 0; i < steps; ++i) {
    const model::Utime at =
        raw.utime + static_cast<model::Utime>(std::llround(static_cast<double>(i) * 1e3));
    const MotionState state = history.at(at).value_or(target);
    const Eigen::Isometry3d motion = target_T_odom * pose(state) * vehicle_T_sensor;
    result.emplace_back(motion.matrix().topRows<3>().cast<float>());
  }
  return result;
}

}  // namespace

model::Utime end_of_revolution(const model::PointSweep& sweep) {
  float last = 0.0F;
  for (const model::SweepPoint& point : sweep.points) last = std::max(last, point.time_s);
  return sweep.utime + static_cast<model::Utime>(std::llround(static_cast<double>(last) * 1e6));
}

std::size_t remove_bad_points(model::PointSweep& sweep, double min_range_m) {
  std::size_t bad = 0;
  const auto least = static_cast<float>(min_range_m * min_range_m);
  std::erase_if(sweep.points, [&](const model::SweepPoint& p) {
    const float sum = p.x_m * p.x_m + p.y_m * p.y_m + p.z_m * p.z_m;
    const bool good = std::isfinite(sum) && p.time_s >= 0.0F && p.time_s <= kLongestRevolution_s;
    if (!good) ++bad;
    return !good || sum < least;
  });
  return bad;
}

void times_from_azimuth(model::PointSweep& sweep, double revolution_s, bool clockwise) {
  if (sweep.points.empty()) return;
  const float sign = clockwise ? -1.0F : 1.0F;
  constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  const float start = sign * std::atan2(sweep.points.front().y_m, sweep.points.front().x_m);
  for (model::SweepPoint& point : sweep.points) {
    float angle = sign * std::atan2(point.y_m, point.x_m) - start;
    if (angle < 0.0F) angle += kTurn;
    // Beams of one firing have slightly different azimuths: slightly before the start.
    if (angle > kTurn - 0.02F) angle = 0.0F;
    point.time_s = static_cast<float>(revolution_s) * angle / kTurn;
  }
  std::ranges::stable_sort(sweep.points, {}, &model::SweepPoint::time_s);
  sweep.has_times = true;
}

bool has_beam_times(const model::PlanarScan& scan) {
  const double duration_s = scan.duration_s();
  return duration_s > 0.0 && duration_s <= static_cast<double>(kLongestRevolution_s);
}

model::PointSweep sweep_of(const model::PlanarScan& scan) {
  model::PointSweep sweep;
  sweep.utime = scan.utime;
  sweep.sequence = scan.sequence;
  sweep.revolution = scan.sequence;
  sweep.rings = 1;
  sweep.max_range_m = scan.max_range_m;
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    if (!scan.is_return(beam)) continue;
    const double range_m = scan.ranges_m[beam];
    model::SweepPoint point;
    point.x_m = static_cast<float>(range_m * std::cos(scan.bearing(beam)));
    point.y_m = static_cast<float>(range_m * std::sin(scan.bearing(beam)));
    point.time_s = static_cast<float>(static_cast<double>(beam) * scan.beam_interval_s);
    sweep.points.push_back(point);
  }
  return sweep;
}

namespace {

/// Transforms each point, interpolating between the two steps around its time.
void move_points(model::PointSweep& sweep, const std::vector<Motion>& table, float shift_s) {
  const std::size_t steps = table.size();
  for (model::SweepPoint& point : sweep.points) {
    const float at = std::clamp(point.time_s / kStep_s, 0.0F, static_cast<float>(steps) - 1.001F);
    const auto step = static_cast<std::size_t>(at);
    const float share = at - static_cast<float>(step);
    const Eigen::Vector4f p(point.x_m, point.y_m, point.z_m, 1.0F);
    const Eigen::Vector3f a = table[step] * p;
    const Eigen::Vector3f b = table[step + 1] * p;
    const Eigen::Vector3f moved = a + share * (b - a);
    point.x_m = moved.x();
    point.y_m = moved.y();
    point.z_m = moved.z();
    if (sweep.has_times) point.time_s = std::min(0.0F, point.time_s - shift_s);
  }
}

/// Roll and pitch of a state.
model::Attitude attitude_of(const MotionState& state) {
  const RollPitchYaw angles = roll_pitch_yaw(state.odom_Q_vehicle);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angles.pitch_rad, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(angles.roll_rad, Eigen::Vector3d::UnitX())),
          state.tilt_covariance};
}

}  // namespace

DeskewedSweep deskew(model::PointSweep raw, model::Utime utime, const MotionHistory& history,
                     const SensorMount& mount) {
  DeskewedSweep result;
  const auto known = history.at(utime);
  const MotionState target = known.value_or(MotionState{});
  result.had_motion = known && raw.has_times && history.at(raw.utime);

  // Pose of the sensor at each millisecond.
  const auto last_s =
      static_cast<float>(static_cast<double>(end_of_revolution(raw) - raw.utime) * 1e-6);
  const auto steps = static_cast<std::size_t>(std::max(0.0F, last_s) / kStep_s) + 2;
  const MotionHistory still;
  const std::vector<Motion> table =
      motions(raw, target, result.had_motion ? history : still, mount, steps);
  const auto shift_s = static_cast<float>(static_cast<double>(utime - raw.utime) * 1e-6);

  // In place: a revolution of many beams has megabytes.
  model::PointSweep& sweep = result.sweep;
  sweep = std::move(raw);
  sweep.utime = utime;
  sweep.is_deskewed = true;
  move_points(sweep, table, shift_s);

  sweep.sensor_position_m = mount.position_m();
  if (known) sweep.attitude = attitude_of(*known);
  return result;
}

}  // namespace understory::lidar_imu_input
