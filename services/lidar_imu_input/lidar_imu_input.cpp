#include "services/lidar_imu_input/lidar_imu_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/lidar_imu_input/deskew.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::size_t kComparedPoints = 64;

model::Utime microseconds(double seconds) {
  return static_cast<model::Utime>(std::llround(seconds * 1e6));
}

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

InputFault not_finite(Sensor sensor) {
  return {InputFaultKind::kNotFinite, channel_of(sensor), "a value that is no number"};
}

}  // namespace

LidarImuInput::LidarImuInput(const LidarImuInputParameters& parameters)
    : parameters_(parameters), guard_(parameters.fault, parameters.imu), motion_(parameters) {}

void LidarImuInput::report(std::vector<InputFault>& faults, InputResults& out) {
  for (InputFault& fault : faults) out.emplace_back(std::move(fault));
  faults.clear();
}

InputResults LidarImuInput::add(const model::ImuSample& raw) {
  InputResults out;
  if (!is_finite(raw)) return {not_finite(Sensor::kImu)};
  check_pause(Sensor::kImu, raw.utime, out);
  std::vector<InputFault> faults;
  const bool frozen = guard_.is_frozen(raw, faults);
  const bool saturated = guard_.is_saturated(raw, faults);
  const auto utime = frozen ? std::nullopt : guard_.admit(Sensor::kImu, raw.utime, faults);
  report(faults, out);
  if (utime && saturated) {
    // It tells a bound, not a motion. Over a bump the samples beside it are joined, with more
    // noise; where it lasts the wheels go on alone, as without an IMU.
    ++counters_.samples_saturated;
    was_saturated_ = true;
  } else if (utime) {
    model::ImuSample sample = raw;
    sample.utime = *utime;
    sample = motion_.to_vehicle(sample);
    motion_.add_imu(sample, std::exchange(was_saturated_, false));
    out.emplace_back(sample);
    publish_raw_pose(false, out);
    check_calibration(out);
  }
  settle(out, false);
  return out;
}

InputResults LidarImuInput::add(const model::WheelSample& raw) {
  InputResults out;
  if (!is_finite(raw)) return {not_finite(Sensor::kWheels)};
  check_pause(Sensor::kWheels, raw.utime, out);
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kWheels, raw.utime, faults);
  report(faults, out);
  if (utime) {
    model::WheelSample sample = raw;
    sample.utime = *utime;
    motion_.add_wheels(sample);
    out.emplace_back(sample);
  }
  settle(out, false);
  return out;
}

InputResults LidarImuInput::add(const model::GnssFix& raw) {
  InputResults out;
  if (!is_finite(raw)) return {not_finite(Sensor::kGnss)};
  check_pause(Sensor::kGnss, raw.utime, out);
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kGnss, raw.utime, faults);
  report(faults, out);
  if (utime) {
    model::GnssFix fix = raw;
    fix.utime = *utime;
    motion_.add_gnss(fix);
    out.emplace_back(fix);
  }
  settle(out, false);
  return out;
}

bool LidarImuInput::is_repeated(const model::PointSweep& sweep) {
  const auto count = std::min(sweep.points.size(), kComparedPoints);
  const auto same = [](const model::SweepPoint& a, const model::SweepPoint& b) {
    return a.x_m == b.x_m && a.y_m == b.y_m && a.z_m == b.z_m;
  };
  const bool repeated =
      count == kComparedPoints && first_points_.size() == count &&
      std::equal(first_points_.begin(), first_points_.end(), sweep.points.begin(), same);
  first_points_.assign(sweep.points.begin(),
                       sweep.points.begin() + static_cast<std::ptrdiff_t>(count));
  return repeated;
}

InputResults LidarImuInput::add(model::PointSweep sweep) {
  InputResults out;
  const std::size_t came = sweep.points.size();
  const std::size_t bad = remove_bad_points(sweep, parameters_.lidar.min_range_m);
  counters_.points_dropped += bad;
  if (bad > 0)
    out.emplace_back(InputFault{InputFaultKind::kNotFinite, channel_of(Sensor::kSweep),
                                fmt::format("{} of {} points are no points", bad, came)});
  if (is_repeated(sweep))
    out.emplace_back(InputFault{InputFaultKind::kFrozen, channel_of(Sensor::kSweep),
                                "the same points as in the turn before"});
  if (!sweep.has_times) {
    const std::string& way = parameters_.lidar.times_from_azimuth;
    if (way != "none")
      times_from_azimuth(sweep, parameters_.lidar.revolution_s, way == "clockwise");
    out.emplace_back(InputFault{InputFaultKind::kNoPointTimes, channel_of(Sensor::kSweep),
                                way == "none" ? "points without times: not de-skewed"
                                              : "points without times: taken from the azimuth"});
  }
  check_pause(Sensor::kSweep, sweep.utime, out);
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kSweep, sweep.utime, faults);
  report(faults, out);
  if (utime) {
    sweep.utime = *utime;
    const model::Utime end = end_of_revolution(sweep);
    wait(end, std::move(sweep), out);
  }
  settle(out, false);
  return out;
}

InputResults LidarImuInput::add(const model::PlanarScan& raw) {
  InputResults out;
  check_pause(Sensor::kScan, raw.utime, out);
  std::vector<InputFault> faults;
  const auto utime = guard_.admit(Sensor::kScan, raw.utime, faults);
  report(faults, out);
  if (utime) {
    model::PlanarScan scan = raw;
    scan.utime = *utime;
    wait(*utime, std::move(scan), out);
  }
  settle(out, false);
  return out;
}

InputResults LidarImuInput::add(const model::VelocityCorrection& correction) {
  if (!is_finite(correction))
    return {
        InputFault{InputFaultKind::kNotFinite, "VELOCITY_CORRECTION", "a value that is no number"}};
  if (motion_.add_correction(correction)) return {};
  ++counters_.corrections_late;
  return {InputFault{InputFaultKind::kLate, "VELOCITY_CORRECTION",
                     "takes effect later than its delay says"}};
}

InputResults LidarImuInput::add(const model::EkfPose& pose) {
  filter_motion_.add(pose);
  return {};
}

InputResults LidarImuInput::finish() {
  InputResults out;
  settle(out, true);
  return out;
}

void LidarImuInput::publish_raw_pose(bool at_once, InputResults& out) {
  const model::RawPose pose = motion_.raw_pose();
  const model::Utime period = microseconds(parameters_.output.raw_pose_period_s);
  if (raw_pose_utime_ && pose.utime <= *raw_pose_utime_) return;
  if (!at_once && raw_pose_utime_ && pose.utime - *raw_pose_utime_ < period) return;
  raw_pose_utime_ = pose.utime;
  out.emplace_back(pose);
}

void LidarImuInput::check_calibration(InputResults& out) {
  if (calibration_reported_ || motion_.is_calibrated()) return;
  const auto state = motion_.history().newest();
  // Surely moving: faster than standing allows, for what is known.
  const bool moves = !motion_.is_stationary() &&
                     state.utime - motion_.history().oldest().utime > microseconds(1.0) &&
                     guard_.is_live(Sensor::kImu);
  if (!moves) return;
  calibration_reported_ = true;
  out.emplace_back(InputFault{InputFaultKind::kNotCalibrated, channel_of(Sensor::kImu),
                              "the vehicle moves before it has stood still long enough"});
}

}  // namespace understory::lidar_imu_input
