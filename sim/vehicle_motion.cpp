#include "sim/vehicle_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace understory::sim {
namespace {

constexpr double kMotionStep = 0.02;  ///< [s]
constexpr double kSpacing = 0.25;     ///< Of the speed limits along the route [m].
constexpr double kEasing = 0.6;       ///< Time over which a change of acceleration is spread [s].

/// Largest speed at every kSpacing of the route, by curvature, by stops and by the limits of engine
/// and brakes (forward and backward pass).
std::vector<double> speed_limits(const Route& route, const SpeedParameters& parameters) {
  const auto count = static_cast<std::size_t>(std::floor(route.length_m() / kSpacing)) + 1;
  std::vector<double> squared(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double curvature = std::abs(route.at(static_cast<double>(i) * kSpacing).curvature);
    squared[i] = std::min(parameters.cruise_mps * parameters.cruise_mps,
                          parameters.lateral_mps2 / std::max(curvature, 1e-9));
  }

  squared.front() = squared.back() = 0.0;
  for (const auto& stop : parameters.stops) {
    const double at = std::clamp(stop.along_m / kSpacing, 0.0, static_cast<double>(count - 1));
    squared[static_cast<std::size_t>(std::lround(at))] = 0.0;
  }

  for (std::size_t i = 1; i < count; ++i) {
    squared[i] =
        std::min(squared[i], squared[i - 1] + 2.0 * kSpacing * parameters.acceleration_mps2);
  }

  for (std::size_t i = count - 1; i > 0; --i) {
    squared[i - 1] =
        std::min(squared[i - 1], squared[i] + 2.0 * kSpacing * parameters.braking_mps2);
  }

  for (double& value : squared) value = std::sqrt(value);
  return squared;
}

double standing_at(const SpeedParameters& parameters, std::size_t place, std::size_t count) {
  if (place + 1 == count) return parameters.end_standstill_s;
  for (const auto& stop : parameters.stops) {
    if (std::lround(stop.along_m / kSpacing) == static_cast<long>(place)) return stop.seconds;
  }
  return 0.0;
}

/// Distance driven at every step of time.
std::vector<double> distances(const Route& route, const SpeedParameters& parameters) {
  const std::vector<double> limits = speed_limits(route, parameters);

  // Times of departure and arrival at each place; between places the acceleration is constant.
  std::vector<double> along;
  const auto stand = [&](double seconds, double at_m) {
    along.insert(along.end(), static_cast<std::size_t>(std::lround(seconds / kMotionStep)), at_m);
  };

  stand(parameters.standstill_s, 0.0);
  double late = 0.0;  // of the next sample, after the place was left
  for (std::size_t i = 0; i + 1 < limits.size(); ++i) {
    const double from = limits[i];
    const double to = limits[i + 1];
    const double seconds = 2.0 * kSpacing / std::max(from + to, 1e-3);
    const double acceleration = (to - from) / seconds;

    for (; late < seconds; late += kMotionStep) {
      along.push_back(static_cast<double>(i) * kSpacing + from * late +
                      0.5 * acceleration * late * late);
    }

    late -= seconds;
    const double stationary_s = standing_at(parameters, i + 1, limits.size());
    if (stationary_s > 0.0) {
      stand(stationary_s, static_cast<double>(i + 1) * kSpacing);
      late = 0.0;
    }
  }

  return along;
}

/// Mean over a window of `half` steps to both sides; the end values are repeated.
std::vector<double> box_smoothed(const std::vector<double>& values, int half) {
  std::vector<double> result(values.size());
  const auto at = [&](std::ptrdiff_t i) {
    return values[static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(values.size()) - 1))];
  };
  const auto count = static_cast<std::ptrdiff_t>(values.size());
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    // Relative to the middle: constant stretches stay bitwise constant.
    double sum = 0.0;
    for (std::ptrdiff_t k = i - half; k <= i + half; ++k) sum += at(k) - at(i);
    result[static_cast<std::size_t>(i)] = at(i) + sum / (2 * half + 1);
  }
  return result;
}

/// Height, roll and pitch of the body: each follows its target like a damped spring.
class Suspension {
 public:
  explicit Suspension(const VehicleParameters& parameters)
      : omega_(2.0 * std::numbers::pi * parameters.suspension_hz),
        damping_(parameters.suspension_damping) {}

  Eigen::Vector3d follow(const Eigen::Vector3d& goal) {
    if (!started_) {
      value_ = goal_ = goal;
      started_ = true;
    }

    constexpr int kSubsteps = 4;
    const double dt = kMotionStep / kSubsteps;
    const Eigen::Vector3d goal_rate = (goal - goal_) / kMotionStep;

    for (int i = 1; i <= kSubsteps; ++i) {
      const Eigen::Vector3d target = goal_ + static_cast<double>(i) / kSubsteps * (goal - goal_);
      rate_ += dt * (omega_ * omega_ * (target - value_) +
                     2.0 * damping_ * omega_ * (goal_rate - rate_));
      value_ += dt * rate_;
    }

    goal_ = goal;
    return value_;
  }

 private:
  double omega_;
  double damping_;
  bool started_ = false;
  Eigen::Vector3d goal_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_ = Eigen::Vector3d::Zero();
};

/// (height at the rear axle, roll, pitch) of a plane through the contact points of the four wheels.
Eigen::Vector3d on_wheels(const Ground& ground, const geometry::SE2& pose,
                          const VehicleParameters& vehicle) {
  const double half = 0.5 * vehicle.track_m;
  const double rear_left = ground.height(pose * Eigen::Vector2d(0.0, half));
  const double rear_right = ground.height(pose * Eigen::Vector2d(0.0, -half));
  const double front_left = ground.height(pose * Eigen::Vector2d(vehicle.wheelbase_m, half));
  const double front_right = ground.height(pose * Eigen::Vector2d(vehicle.wheelbase_m, -half));
  const double rise = 0.5 * (front_left + front_right - rear_left - rear_right);
  const double tilt = 0.5 * (front_left + rear_left - front_right - rear_right);
  return {0.5 * (rear_left + rear_right), std::atan2(tilt, vehicle.track_m),
          -std::atan2(rise, vehicle.wheelbase_m)};
}

}  // namespace

Eigen::Isometry3d VehicleState::world_T_vehicle() const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = world_Q_vehicle.toRotationMatrix();
  pose.translation() = position_m;
  return pose;
}

VehicleMotion::VehicleMotion(const Route& route, const Ground& ground,
                             const VehicleParameters& vehicle, const SpeedParameters& speed)
    : vehicle_(vehicle) {
  std::vector<double> along = distances(route, speed);
  const int half = static_cast<int>(std::lround(0.5 * kEasing / kMotionStep));
  for (int pass = 0; pass < 3; ++pass) along = box_smoothed(along, half);
  driven_m_ = along.empty() ? 0.0 : along.back();

  std::vector<UniformSpline<6>::Vector> points;
  points.reserve(along.size());
  Suspension suspension(vehicle);
  double yaw = route.at(0.0).heading_rad;
  const auto distance = [&](std::ptrdiff_t k) {
    return along[static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(k, 0, static_cast<std::ptrdiff_t>(along.size()) - 1))];
  };
  for (std::ptrdiff_t k = 0; k < static_cast<std::ptrdiff_t>(along.size()); ++k) {
    const Route::Place place = route.at(distance(k));
    yaw += geometry::wrap_angle(place.heading_rad - yaw);
    const double velocity = (distance(k + 1) - distance(k - 1)) / (2.0 * kMotionStep);
    const double acceleration =
        (distance(k + 1) - 2.0 * distance(k) + distance(k - 1)) / (kMotionStep * kMotionStep);
    Eigen::Vector3d goal = on_wheels(ground, {place.position_m, yaw}, vehicle);
    // A curve to the left rolls the body to the right: positive roll (left side up).
    goal.y() += vehicle.roll_per_mps2 * velocity * velocity * place.curvature;
    goal.z() -= vehicle.pitch_per_mps2 * acceleration;
    const Eigen::Vector3d body = suspension.follow(goal);
    UniformSpline<6>::Vector point;
    point << place.position_m, body.x(), body.y(), body.z(), yaw;
    points.push_back(point);
  }
  pose_ = UniformSpline<6>(std::move(points), kMotionStep);
}

VehicleMotion VehicleMotion::replayed(std::vector<UniformSpline<6>::Vector> poses, double step_s) {
  VehicleMotion motion;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    motion.driven_m_ += (poses[i] - poses[i - 1]).head<3>().norm();
  }
  motion.pose_ = UniformSpline<6>(std::move(poses), step_s);
  return motion;
}

VehicleState VehicleMotion::at(double time_s) const {
  const auto value = pose_.at(std::clamp(time_s, 0.0, duration_s()));
  VehicleState state;
  state.time_s = time_s;
  state.position_m = value.position.head<3>();
  state.velocity_mps = value.first.head<3>();
  state.acceleration_mps2 = value.second.head<3>();
  state.roll_rad = value.position[3];
  state.pitch_rad = value.position[4];
  state.yaw_rad = value.position[5];
  const double sr = std::sin(state.roll_rad), cr = std::cos(state.roll_rad);
  const double sp = std::sin(state.pitch_rad), cp = std::cos(state.pitch_rad);
  state.world_Q_vehicle = Eigen::AngleAxisd(state.yaw_rad, Eigen::Vector3d::UnitZ()) *
                          Eigen::AngleAxisd(state.pitch_rad, Eigen::Vector3d::UnitY()) *
                          Eigen::AngleAxisd(state.roll_rad, Eigen::Vector3d::UnitX());

  // Rates of the Euler angles in the body's frame, and their derivative.
  const double roll1 = value.first[3], pitch1 = value.first[4], yaw1 = value.first[5];
  const double roll2 = value.second[3], pitch2 = value.second[4], yaw2 = value.second[5];
  state.angular_rate_rad_s = {roll1 - yaw1 * sp, pitch1 * cr + yaw1 * sr * cp,
                              -pitch1 * sr + yaw1 * cr * cp};
  state.angular_acceleration_rad_s2 = {roll2 - yaw2 * sp - yaw1 * pitch1 * cp,
                                       pitch2 * cr - pitch1 * roll1 * sr + yaw2 * sr * cp +
                                           yaw1 * (roll1 * cr * cp - pitch1 * sr * sp),
                                       -pitch2 * sr - pitch1 * roll1 * cr + yaw2 * cr * cp -
                                           yaw1 * (roll1 * sr * cp + pitch1 * cr * sp)};

  return state;
}

}  // namespace understory::sim
