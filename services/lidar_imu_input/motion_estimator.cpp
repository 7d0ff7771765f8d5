#include "services/lidar_imu_input/motion_estimator.hpp"

#include "services/lidar_imu_input/level_motion.hpp"
#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// IMU samples with a larger delay are not waited for.
constexpr double kLatestImu_s = 12.0;

}  // namespace

MotionEstimator::MotionEstimator(const LidarImuInputParameters& parameters)
    : parameters_(parameters),
      lever_(parameters.imu),
      levelling_(parameters.imu),
      stationary_(parameters.standstill, parameters.imu),
      pose_(parameters.imu),
      speeds_(parameters.wheels),
      constraints_(parameters.constraint, parameters.wheels.car),
      corrections_(parameters.output.correction_delay_s),
      increments_(parameters) {}

bool MotionEstimator::is_whole() const {
  return levelling_.is_whole() &&
         (!levelling_.attitude() || (!lever_.empty() && !pose_.history().empty()));
}

model::ImuSample MotionEstimator::to_vehicle(const model::ImuSample& sensor_sample) {
  return lever_.to_vehicle(sensor_sample);
}

void MotionEstimator::add_imu(const model::ImuSample& sample, bool is_saturated) {
  const auto& latest = levelling_.latest();
  const double seconds = latest ? seconds_between(latest->utime, sample.utime) : 0.0;
  if (!latest) {
    start(sample);
  } else if (seconds > parameters_.imu.max_gap_s) {
    bridge_gap(sample);
  } else {
    propagate(sample, is_saturated, seconds);
  }
  pose_.reach(sample.utime);

  use_corrections(sample.utime);
  pose_.remember(sample, *levelling_.attitude());
  correct_by_wheels_reached(sample);
}

void MotionEstimator::start(const model::ImuSample& sample) {
  levelling_.begin(sample);
  increments_.add(*levelling_.latest_level());
  stationary_.begin_at(sample.utime);
}

void MotionEstimator::propagate(const model::ImuSample& sample, bool is_saturated, double seconds) {
  // Attitude.
  levelling_.propagate(sample, is_saturated, seconds);
  AttitudeFilter& attitude = *levelling_.attitude();

  // Standstill: velocity zero, and the gyro measures its bias.
  const bool was_stationary = stationary_.moved_utime() < levelling_.latest()->utime;
  stationary_.add(lever_.latest_raw(), seconds, attitude.gyro_bias(),
                  VelocityEvidence::of(pose_.reckoning(), speeds_.are_fresh(sample.utime),
                                       corrections_.applied_utime()));
  if (is_stationary()) use_standstill(sample, seconds);
  const bool starts = was_stationary && !is_stationary();
  if (starts) go_back_to_rest();

  // Dead reckoning, and the samples of the next increment.
  const LevelSample levelled = levelling_.level(sample, is_saturated);
  const double climb_mps = (attitude.level_Q_vehicle() * attitude.velocity()).z();
  pose_.propagate(*levelling_.latest_level(), levelled, climb_mps, seconds);
  if (starts) pose_.reckoning().set_velocity(attitude.level_velocity());
  increments_.add(levelled);
  levelling_.set_latest(sample, levelled);

  // Constraints of a moving vehicle.
  if (!is_stationary())
    constraints_.apply(sample, levelled.yaw_rate_rad_s, speeds_.are_fresh(sample.utime), attitude,
                       pose_.reckoning());
}

/// The standstill ended some tenths of a second ago; since then zero velocity was applied although
/// the vehicle moved.
void MotionEstimator::go_back_to_rest() {
  const auto rest_utime = levelling_.start_moving();
  if (!rest_utime) return;
  rest_.go_back(*rest_utime);
  stationary_.learn_bias(*levelling_.attitude());
  const YawRateBias& bias = stationary_.bias();
  pose_.reckoning().set_gyro_bias(bias.bias_rad_s, bias.sigma_rad_s);
}

void MotionEstimator::bridge_gap(const model::ImuSample& sample) {
  levelling_.bridge(seconds_between(levelling_.latest()->utime, sample.utime));
  stationary_.begin_at(sample.utime);
  // The wheel samples of the gap belong to an earlier velocity.
  while (!ahead_.empty() && ahead_.front().utime < sample.utime) ahead_.pop_front();

  const double last_rate = levelling_.latest_level()->yaw_rate_rad_s;
  pose_.bridge_gap(sample.utime, last_rate - stationary_.bias().bias_rad_s);

  const LevelSample levelled = levelling_.level(sample, false);
  levelling_.set_latest(sample, levelled);
  increments_.add(levelled);
}

void MotionEstimator::use_standstill(const model::ImuSample& sample, double seconds) {
  AttitudeFilter& attitude = *levelling_.attitude();
  const double sigma = parameters_.standstill.velocity_sigma_mps;
  attitude.add_standstill(sample.angular_rate_rad_s, seconds, sigma);
  levelling_.keep_rest(sample);
  rest_.add_stationary(stationary_.moved_utime(), sample.utime);

  // The bias of the heading's rate, only from the filter's estimate while stationary.
  stationary_.learn_bias(attitude);
  const YawRateBias& bias = stationary_.bias();
  pose_.reckoning().set_gyro_bias(bias.bias_rad_s, bias.sigma_rad_s);
  pose_.reckoning().add_standstill(sigma);
}

void MotionEstimator::add_wheels(const model::WheelSample& sample) {
  increments_.add(sample);
  stationary_.add_wheel_speed(sample.utime, sample.speed_mps);

  // Corrects the speed by the scale that IMU and wheels together give.
  const auto then = pose_.history().at(sample.utime);
  const double speed_mps = middle_speed(sample, then ? &*then : nullptr);
  speeds_.add(speeds_.corrected(sample.utime, speed_mps, wheel_scale()));

  const auto& latest = levelling_.latest();
  if (!latest) return;
  if (seconds_between(latest->utime, sample.utime) > parameters_.imu.max_gap_s) {
    ahead_.push_back(sample);
    while (seconds_between(ahead_.front().utime, sample.utime) > kLatestImu_s) ahead_.pop_front();
    return;
  }
  // Late samples in one burst contain the same error of the velocity of that time: applying it once
  // for each sample would overcorrect the present velocity.
  if (then && speeds_.are_fresh(latest->utime)) correct_by_wheels(sample, *then);
}

/// Speed of the axle's middle [m/s]: a wheel left of it is slower in a left turn.
double MotionEstimator::middle_speed(const model::WheelSample& sample,
                                     const MotionState* then) const {
  const CarGeometry& car = parameters_.wheels.car;
  if (then == nullptr) return axle_speed(car, sample.speed_mps, sample.steering_rad);
  return sample.speed_mps + then->rate_rad_s.z() * car.encoder_left_m;
}

/// The scale of the wheels from IMU and wheels together; none without an IMU.
std::optional<WheelScale> MotionEstimator::wheel_scale() const {
  const std::optional<AttitudeFilter>& attitude = levelling_.attitude();
  if (!attitude) return std::nullopt;
  return WheelScale{attitude->wheel_scale(), attitude->wheel_scale_sigma()};
}

/// `then`: the motion at the sample, by attitude and dead reckoning.
void MotionEstimator::correct_by_wheels(const model::WheelSample& sample, const MotionState& then) {
  if (is_stationary()) return;
  const double speed_mps = middle_speed(sample, &then);
  constraints_.add_wheel_speed(speed_mps, speeds_.corrected(sample.utime, speed_mps, wheel_scale()),
                               then, levelling_.latest_level()->pitch_cosine,
                               *levelling_.attitude(), pose_.reckoning());
}

/// Uses wheel samples that the IMU has reached.
void MotionEstimator::correct_by_wheels_reached(const model::ImuSample& sample) {
  while (!ahead_.empty() && ahead_.front().utime <= sample.utime) {
    correct_by_wheels(ahead_.front(), pose_.state_at(sample, *levelling_.attitude()));
    ahead_.pop_front();
  }
}

void MotionEstimator::add_gnss(const model::GnssFix& fix) {
  if (!parameters_.gnss_aided) return;
  const auto then = pose_.history().at(fix.utime);
  if (!then) return;
  const auto reference = reference_.add(fix, then->heading_rad);
  if (!reference) return;

  const Eigen::Vector2d level = geometry::SE2(0.0, 0.0, then->heading_rad).rotation().transpose() *
                                reference->odom_velocity_mps;
  for (int axis = 0; axis < 2; ++axis)
    pose_.reckoning().add_velocity(Eigen::Vector2d::Unit(axis), Eigen::Vector2d::Zero(),
                                   level(axis) - then->level_velocity_mps(axis),
                                   reference->sigma_mps);
  if (reference->heading_rad)
    pose_.reckoning().add_heading(geometry::wrap_angle(*reference->heading_rad - then->heading_rad),
                                  reference->heading_sigma_rad);
}

bool MotionEstimator::add_correction(const model::VelocityCorrection& correction) {
  const auto& latest = levelling_.latest();
  return corrections_.add(correction, latest ? std::optional(latest->utime) : std::nullopt);
}

void MotionEstimator::use_corrections(model::Utime now) {
  while (const auto correction = corrections_.take_due(now)) {
    // A reference is corrected only by GNSS.
    if (parameters_.gnss_aided) continue;
    const auto then = pose_.history().at(correction->utime);
    if (!then) continue;
    const Eigen::Matrix2d odom_R_then = planar_rotation(then->heading_rad);
    const Eigen::Vector2d then_velocity_mps =
        then->level_velocity_mps +
        odom_R_then.transpose() * corrections_.change_since(correction->utime);
    pose_.reckoning().correct(*correction, then_velocity_mps, then->heading_rad);
    corrections_.set_applied(now, odom_R_then * (correction->velocity_mps - then_velocity_mps));
  }
}

std::optional<model::Odometry> MotionEstimator::increment(model::Utime from, model::Utime to) {
  std::optional<AttitudeFilter>& attitude = levelling_.attitude();
  auto odometry = increments_.make(
      from, to, {attitude ? &*attitude : nullptr, speeds_, history(), stationary_});
  // If no IMU sample has moved the pose, the wheels move it.
  if (odometry && !odometry->inertial) pose_.follow_wheels(*odometry);
  return odometry;
}

std::optional<model::RestLevel> MotionEstimator::rest_news(model::Utime utime) {
  const std::optional<AttitudeFilter>& attitude = levelling_.attitude();
  return attitude ? rest_.news(utime, *attitude) : std::nullopt;
}

}  // namespace understory::lidar_imu_input
