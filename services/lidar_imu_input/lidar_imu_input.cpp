#include "services/lidar_imu_input/lidar_imu_input.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "services/lidar_imu_input/deskew.hpp"
#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

bool is_finite(const model::ImuSample& s) {
  return s.angular_rate_rad_s.allFinite() && s.specific_force_mps2.allFinite();
}
bool is_finite(const model::WheelSample& s) {
  return std::isfinite(s.speed_mps) && std::isfinite(s.steering_rad);
}
bool is_finite(const model::GnssFix& f) {
  return f.east_north_m.allFinite() && std::isfinite(f.sigma_m) &&
         (!f.velocity_mps || f.velocity_mps->allFinite());
}
bool is_finite(const model::VelocityCorrection& c) {
  return c.velocity_mps.allFinite() && c.bias.allFinite() && c.covariance.allFinite();
}

/// A laser's points are checked individually.
bool is_finite(const model::PointSweep& /*sweep*/) { return true; }
bool is_finite(const model::PlanarScan& /*scan*/) { return true; }

InputFault not_finite(const std::string& channel) {
  return {InputFaultKind::kNotFinite, channel, "a value that is no number"};
}

/// Appends the faults to the results.
void report(std::vector<InputFault>& faults, InputResults& out) {
  for (InputFault& fault : faults) out.emplace_back(std::move(fault));
  faults.clear();
}

/// Removes invalid points; returns their number.
std::size_t clean(model::PointSweep& sweep, const DeskewParameters& parameters,
                  std::vector<InputFault>& faults) {
  const std::size_t came = sweep.points.size();
  const std::size_t bad = remove_bad_points(sweep, parameters.min_range_m);
  if (bad > 0)
    faults.push_back({InputFaultKind::kNotFinite, channel_of(Sensor::kSweep),
                      fmt::format("{} of {} points are not finite", bad, came)});
  return bad;
}

InputFault after_pause(Sensor sensor, double pause_s) {
  return {InputFaultKind::kPaused, channel_of(sensor),
          fmt::format("no sensor was heard for {:.2f} s: {}", pause_s,
                      pause_s > LidarImuInput::kLongestPause_s ? "everything begins anew"
                                                               : "time goes on")};
}

InputFault after_step_back(Sensor sensor, double back_s) {
  return {InputFaultKind::kPaused, channel_of(sensor),
          fmt::format("all clocks went back by {:.2f} s, as another recording does: everything "
                      "begins anew",
                      back_s)};
}

/// A sweep without times is not de-skewed, unless its azimuths give the times.
InputFault without_times(model::PointSweep& sweep, const DeskewParameters& parameters) {
  const std::string& direction = parameters.times_from_azimuth;
  if (direction == "none")
    return {InputFaultKind::kNoPointTimes, channel_of(Sensor::kSweep),
            "points without times: not de-skewed"};
  times_from_azimuth(sweep, parameters.revolution_s, direction == "clockwise");
  return {InputFaultKind::kNoPointTimes, channel_of(Sensor::kSweep),
          "points without times: taken from the azimuth"};
}

/// Removes beam times that exceed the duration of a revolution.
std::optional<InputFault> without_impossible_times(model::PlanarScan& scan) {
  if (scan.beam_interval_s == 0.0 || scan.ranges_m.size() < 2 || has_beam_times(scan))
    return std::nullopt;
  scan.beam_interval_s = 0.0;
  return InputFault{InputFaultKind::kNoPointTimes, channel_of(Sensor::kScan),
                    "beams of a scan over more than a revolution: taken as one instant"};
}

}  // namespace

LidarImuInput::LidarImuInput(const LidarImuInputParameters& parameters)
    : parameters_(parameters),
      time_base_(parameters.fault),
      order_(parameters.fault),
      guard_(parameters.fault, parameters.imu, parameters.expected),
      gravity_(parameters.imu.mount, parameters.standstill),
      agreement_(parameters),
      laser_(parameters.lidar),
      motion_(parameters),
      raw_poses_(parameters.output.raw_pose_period_s) {}

InputResults LidarImuInput::add(RawReading raw) {
  const auto finite = [](const auto& value) { return is_finite(value); };
  const Sensor sensor = sensor_of(raw);
  if (!std::visit(finite, raw)) return {not_finite(channel_of(sensor))};
  InputResults out;
  std::vector<InputFault> faults;

  // Are the sweep's points valid?
  if (auto* sweep = std::get_if<model::PointSweep>(&raw)) {
    counters_.points_dropped += clean(*sweep, parameters_.lidar, faults);
    guard_.is_frozen(*sweep, faults);
    if (!sweep->has_times) faults.push_back(without_times(*sweep, parameters_.lidar));
  }
  if (auto* scan = std::get_if<model::PlanarScan>(&raw)) {
    if (auto fault = without_impossible_times(*scan)) faults.push_back(*std::move(fault));
  }

  // Is its stamp to be trusted?
  report(faults, out);
  AfterStepBack after = step_back_.take(std::move(raw), guard_);
  if (after.back_s) {
    out.emplace_back(after_step_back(sensor, *after.back_s));
    begin_anew();
  }
  for (RawReading& reading : after.readings) take(std::move(reading), out);
  return out;
}

/// Uses a reading in the time that never goes back.
void LidarImuInput::take(RawReading reading, InputResults& out) {
  const Sensor sensor = sensor_of(reading);
  std::vector<InputFault> faults;
  BelievedReadings believed = time_base_.take(std::move(reading), guard_, faults);
  report(faults, out);
  if (believed.pause_s) out.emplace_back(after_pause(sensor, *believed.pause_s));
  if (believed.pause_s > kLongestPause_s) begin_anew();

  // Uses readings without missing predecessors.
  for (RawReading& one : believed.readings) {
    if (auto fault = order_.add(std::move(one), guard_)) out.emplace_back(*std::move(fault));
    use_ready(out, false);
  }
}

/// The vehicle's pose and its sensors' temperature are unknown.
void LidarImuInput::begin_anew() {
  const StepBack step_back = step_back_;
  const GravityCheck gravity = gravity_;
  const InputCounters counters = counters_;
  *this = LidarImuInput(parameters_);
  step_back_ = step_back;
  gravity_ = gravity;
  counters_ = counters;
}

bool LidarImuInput::leaves_out(Sensor sensor) const {
  const bool is_by_motion = agreement_.is_useless();
  const bool is_of_imu = MotionAgreement::is_of_imu(agreement_.odd());
  if (sensor == Sensor::kImu) return gravity_.is_useless() || (is_by_motion && is_of_imu);
  return sensor == Sensor::kWheels && is_by_motion && !is_of_imu;
}

/// Results from earlier samples are wrong.
void LidarImuInput::begin_motion_anew() {
  motion_ = MotionEstimator(parameters_);
  if (increment_end_) motion_.begin(*increment_end_);
}

void LidarImuInput::note_left_out() {
  const bool imu = leaves_out(Sensor::kImu);
  const bool wheels = leaves_out(Sensor::kWheels);
  if (imu == left_out_imu_ && wheels == left_out_wheels_) return;
  left_out_imu_ = imu;
  left_out_wheels_ = wheels;
  begin_motion_anew();
}

void LidarImuInput::use(const model::ImuSample& raw, InputResults& out) {
  // Is it valid?
  std::vector<InputFault> faults;
  const bool frozen = guard_.is_frozen(raw, faults);
  if (!frozen && gravity_.add(raw)) {
    // All motion so far was in a wrong unit: it begins anew.
    begin_motion_anew();
    out.emplace_back(InputFault{InputFaultKind::kUnit, channel_of(Sensor::kImu),
                                "the acceleration is in g and taken times 9.81: its driver must "
                                "send m/s^2"});
  }
  model::ImuSample sample = raw;
  sample.specific_force_mps2 *= gravity_.scale();
  if (!frozen && !gravity_.is_useless()) agreement_.add(sample);
  const bool saturated = guard_.is_saturated(sample, faults);
  const auto utime = frozen ? std::nullopt : guard_.admit(Sensor::kImu, raw.utime, faults);
  report(faults, out);
  note_left_out();
  if (!utime || left_out_imu_) return;

  if (saturated) {
    // A saturated sample is a bound, not a measurement. Over a bump its neighbours are joined, with
    // more noise; if it lasts longer the wheels are used alone, as without an IMU.
    ++counters_.samples_saturated;
    was_saturated_ = true;
    return;
  }

  sample.utime = *utime;
  sample = motion_.to_vehicle(sample);
  motion_.add_imu(sample, std::exchange(was_saturated_, false));
  out.emplace_back(sample);
  if (auto pose = raw_poses_.take(motion_.raw_pose(), false)) out.emplace_back(*pose);
  if (auto fault = calibration_.check(motion_, guard_.is_live(Sensor::kImu)))
    out.emplace_back(*std::move(fault));
}

void LidarImuInput::use(const model::WheelSample& raw, InputResults& out) {
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kWheels, raw.utime, faults);
  report(faults, out);
  if (!utime) return;
  model::WheelSample sample = raw;
  sample.utime = *utime;
  agreement_.add(sample);
  if (left_out_wheels_) return;
  motion_.add_wheels(sample);
  out.emplace_back(sample);
}

void LidarImuInput::use(const model::GnssFix& raw, InputResults& out) {
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kGnss, raw.utime, faults);
  report(faults, out);
  if (!utime) return;
  model::GnssFix fix = raw;
  fix.utime = *utime;
  motion_.add_gnss(fix);
  out.emplace_back(fix);
}

void LidarImuInput::use(model::PointSweep sweep, InputResults& out) {
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kSweep, sweep.utime, faults);
  report(faults, out);
  if (!utime) return;
  sweep.utime = *utime;
  const model::Utime end = end_of_revolution(sweep);
  wait({end, std::move(sweep)}, out);
}

void LidarImuInput::use(const model::PlanarScan& raw, InputResults& out) {
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kScan, raw.utime, faults);
  report(faults, out);
  if (!utime) return;
  model::PlanarScan scan = raw;
  scan.utime = *utime;
  const model::Utime end = scan.end();
  wait({end, std::move(scan)}, out);
}

InputResults LidarImuInput::add(const model::VelocityCorrection& correction) {
  if (!is_finite(correction)) return {not_finite("VELOCITY_CORRECTION")};
  if (motion_.add_correction(correction)) return {};
  ++counters_.corrections_late;
  return {InputFault{InputFaultKind::kLate, "VELOCITY_CORRECTION",
                     "takes effect later than output.correction_delay_s after its stamp"}};
}

InputResults LidarImuInput::add(const model::EkfPose& pose) {
  filter_motion_.add(pose);
  return {};
}

InputResults LidarImuInput::finish() {
  InputResults out;
  for (RawReading& reading : step_back_.finish()) take(std::move(reading), out);
  for (RawReading& reading : time_base_.finish()) order_.add(std::move(reading), guard_);
  use_ready(out, true);
  settle(out, true);
  return out;
}

/// Uses readings without missing predecessors (or `everything`).
void LidarImuInput::use_ready(InputResults& out, bool everything) {
  while (auto next = order_.next(guard_, everything)) {
    std::visit([&](auto&& value) { use(std::forward<decltype(value)>(value), out); },
               *std::move(next));
    settle(out, false);
  }
}

void LidarImuInput::wait(WaitingSweep waiting, InputResults& out) {
  Admission admission = queue_.add(std::move(waiting), increment_end_);
  if (admission.dropped_oldest) ++counters_.sweeps_dropped;
  if (admission.is_carried) ++counters_.sweeps_carried;
  if (!admission.fault) return;
  ++counters_.sweeps_dropped;
  out.emplace_back(*std::move(admission.fault));
}

/// Ends increments of odometry and releases sweeps, as far as the motion is known (or
/// `everything`).
void LidarImuInput::settle(InputResults& out, bool everything) {
  std::vector<InputFault> faults;
  guard_.find_silent(faults);
  report(faults, out);

  const model::Utime longest = microseconds(parameters_.output.max_increment_s);
  const model::Utime lag = microseconds(parameters_.output.lag_s);
  const auto is_known = [&](model::Utime utime) {
    return everything || guard_.has_motion_until(utime, parameters_.output.max_wait_s);
  };
  while (true) {
    const auto now = guard_.now();
    const bool has_item = !queue_.empty();
    const bool moves = guard_.has_spoken(Sensor::kImu) || guard_.has_spoken(Sensor::kWheels);

    // An increment ends without a sweep if none can arrive for its time any more, or the next is
    // far ahead: then increments of the usual length lead up to it.
    const bool near =
        has_item && increment_end_ && 2 * (queue_.front().end - *increment_end_) <= 3 * longest;
    const bool regular = now && moves && increment_end_ && !near &&
                         (has_item || *now >= *increment_end_ + longest + lag);

    if (regular) {
      if (!is_known(*increment_end_ + longest)) return;
      end_increment(*increment_end_ + longest, out);
    } else if (has_item) {
      if (!is_known(queue_.front().end)) return;
      WaitingSweep next = queue_.take();
      end_increment(next.end, out);
      release(std::move(next), out);
    } else {
      if (now && moves && !increment_end_) end_increment(*now, out);
      return;
    }
  }
}

void LidarImuInput::end_increment(model::Utime utime, InputResults& out) {
  if (!increment_end_) {
    motion_.begin(utime);
    increment_end_ = utime;
    return;
  }
  if (utime <= *increment_end_) return;

  if (auto increment = motion_.increment(*increment_end_, utime)) {
    laser_.travel(increment->from_T_to.translation().norm());
    out.emplace_back(*std::move(increment));
    if (auto pose = raw_poses_.take(motion_.raw_pose(), true)) out.emplace_back(*pose);
    if (auto level = motion_.rest_news(utime)) out.emplace_back(*level);
  } else {
    ++counters_.increments_missing;
  }
  increment_end_ = utime;
}

void LidarImuInput::release(WaitingSweep waiting, InputResults& out) {
  if (!queue_.release(waiting)) {
    ++counters_.sweeps_dropped;
  } else if (auto* scan = std::get_if<model::PlanarScan>(&waiting.item)) {
    release_scan(std::move(*scan), waiting.end, out);
  } else {
    release_sweep(std::get<model::PointSweep>(std::move(waiting.item)), Sensor::kSweep, waiting.end,
                  out);
  }
}

/// Beams with different times are de-skewed like those of a 3-D laser.
void LidarImuInput::release_scan(model::PlanarScan scan, model::Utime stamp, InputResults& out) {
  if (has_beam_times(scan)) {
    release_sweep(sweep_of(scan), Sensor::kScan, stamp, out);
    return;
  }
  const SensorMount& mount = parameters_.planar.mount;
  scan.vehicle_T_sensor = geometry::SE2(mount.x_m, mount.y_m, mount.yaw_rad);
  out.emplace_back(std::move(scan));
}

void LidarImuInput::release_sweep(model::PointSweep raw, Sensor sensor, model::Utime stamp,
                                  InputResults& out) {
  // Without a motion sensor the filter's motion is used.
  MotionHistory by_filter;
  if (!motion_.history().at(stamp)) {
    if (const auto motion = filter_motion_.at(stamp)) by_filter.add(*motion);
  }
  const MotionHistory& history = by_filter.empty() ? motion_.history() : by_filter;

  const bool has_times = raw.has_times;
  if (sensor == Sensor::kSweep) laser_.add_raw(raw);
  const SensorMount& mount =
      sensor == Sensor::kScan ? parameters_.planar.mount : parameters_.lidar.mount;
  DeskewedSweep result = deskew(std::move(raw), stamp, history, mount);
  // Without an IMU the attitude is unknown, and the filter's motion contains none.
  if (!motion_.attitude() || !by_filter.empty()) result.sweep.attitude.reset();

  if (sensor == Sensor::kSweep) laser_.add(result.sweep);

  ++counters_.sweeps;
  if (!by_filter.empty() && result.had_motion) ++counters_.sweeps_by_filter;
  if (!result.had_motion) {
    ++counters_.sweeps_not_deskewed;
    if (has_times)
      out.emplace_back(InputFault{InputFaultKind::kNoMotion, channel_of(sensor),
                                  "no motion is known for the revolution: not de-skewed"});
  }
  out.emplace_back(std::move(result.sweep));
}

}  // namespace understory::lidar_imu_input
