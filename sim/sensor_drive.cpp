#include "sim/sensor_drive.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace understory::sim {

SensorDrive::SensorDrive(Scenario scenario, const VehicleParameters& vehicle,
                         const SpeedParameters& speed, SensorSuite suite, std::uint64_t seed,
                         model::Utime utime_of_start)
    : SensorDrive(scenario, VehicleMotion(scenario.route, scenario.world->ground(), vehicle, speed),
                  std::move(suite), seed, utime_of_start) {}

SensorDrive::SensorDrive(Scenario scenario, VehicleMotion motion, SensorSuite suite,
                         std::uint64_t seed, model::Utime utime_of_start)
    : scenario_(std::move(scenario)),
      suite_(std::move(suite)),
      utime_of_start_(utime_of_start),
      motion_(std::move(motion)) {
  if (suite_.imu) imu_.emplace(*suite_.imu, seed);
  if (suite_.wheels) wheels_.emplace(*suite_.wheels, seed);
  if (suite_.gnss) gnss_.emplace(*suite_.gnss, seed);
  if (suite_.planar_laser) {
    planar_laser_ = std::make_unique<PlanarLaser>(*scenario_.world, *suite_.planar_laser, seed);
  }
  if (suite_.lidar) {
    lidar_ = std::make_unique<SpinningLidar>(*scenario_.world, *suite_.lidar, seed);
  }
}

std::uint64_t SensorDrive::sweep_count() const {
  if (!lidar_) return 0;
  return static_cast<std::uint64_t>(
      std::floor(motion_.duration_s() * lidar_->parameters().revolutions_per_s + 1e-9));
}

/// Among equal times the first listed source: others depend on it.
SensorDrive::Due SensorDrive::next_due() const {
  Due due{std::numeric_limits<double>::infinity(), Source::kTruth};
  const auto offer = [&](double time_s, Source source) {
    // Times are sums of different steps: nearly equal is equal.
    if (time_s < due.time_s - 1e-9) due = {time_s, source};
  };

  if (suite_.truth_rate_hz > 0.0) {
    offer(static_cast<double>(truths_) / suite_.truth_rate_hz, Source::kTruth);
  }

  if (imu_) offer(imu_->next_time_s(), Source::kImu);
  if (wheels_) offer(wheels_->next_time_s(), Source::kWheels);
  if (gnss_) offer(gnss_->next_time_s(), Source::kGnss);
  if (planar_laser_) offer(planar_laser_->end_s(scans_), Source::kPlanarLaser);

  if (lidar_) {
    offer(static_cast<double>(revolutions_ + 1) * lidar_->parameters().revolution_s(),
          Source::kLidar);
  }

  return due;
}

std::optional<SensorReading> SensorDrive::read(Source source) {
  switch (source) {
    case Source::kTruth: {
      const double time_s = static_cast<double>(truths_) / suite_.truth_rate_hz;
      const model::Utime utime =
          utime_of_start_ + static_cast<model::Utime>(std::llround(time_s * 1e6));
      return TruePose{utime, truths_++, motion_.at(time_s)};
    }

    case Source::kImu:
      return imu_->next(motion_, utime_of_start_);
    case Source::kWheels:
      return wheels_->next(motion_, utime_of_start_);
    case Source::kGnss:
      return gnss_->next(motion_, utime_of_start_);
    case Source::kPlanarLaser:
      return planar_laser_->scan(motion_, scans_++, utime_of_start_);
    case Source::kLidar:
      return lidar_->sweep(motion_, revolutions_++, utime_of_start_);
  }

  return std::nullopt;
}

std::optional<SensorReading> SensorDrive::next() {
  for (;;) {
    const Due due = next_due();
    if (!(due.time_s <= motion_.duration_s() + 1e-9)) return std::nullopt;
    // An outage of GNSS gives nothing.
    if (auto reading = read(due.source)) return reading;
  }
}

}  // namespace understory::sim
