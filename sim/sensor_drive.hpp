// A drive with all its sensors, reading by reading.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "sim/motion_sensors.hpp"
#include "sim/planar_laser.hpp"
#include "sim/route.hpp"
#include "sim/spinning_lidar.hpp"
#include "sim/vehicle_motion.hpp"
#include "sim/world.hpp"

namespace understory::sim {

/// Sensors of the vehicle; none = absent.
struct SensorSuite {
  std::optional<ImuParameters> imu = ImuParameters{};
  std::optional<WheelParameters> wheels = WheelParameters{};
  std::optional<GnssParameters> gnss = GnssParameters{};
  std::optional<LidarParameters> lidar = LidarParameters{};
  std::optional<PlanarLaserParameters> planar_laser;
  double truth_rate_hz = 50.0;
};

/// The true state of the vehicle as a reading.
struct TruePose {
  model::Utime utime = 0;
  std::uint64_t sequence = 0;
  VehicleState state;
};

/// Any reading of a drive.
using SensorReading = std::variant<TruePose, model::ImuSample, model::WheelSample, model::GnssFix,
                                   SimulatedPlanarScan, SimulatedSweep>;

/// A world and a path through it.
struct Scenario {
  std::shared_ptr<const World> world;
  Route route;
};

/// Readings are computed on request, in order of their completion (a sweep at the end of its
/// revolution): a drive of any length needs no memory for them. The same arguments give the same
/// readings.
class SensorDrive {
 public:
  /// A drive of `vehicle` along the scenario's route. `utime_of_start` is the stamp of time 0 [us].
  SensorDrive(Scenario scenario, const VehicleParameters& vehicle, const SpeedParameters& speed,
              SensorSuite suite, std::uint64_t seed, model::Utime utime_of_start = 0);
  /// The same with the default vehicle, from stamp 0.
  SensorDrive(Scenario scenario, const SpeedParameters& speed, SensorSuite suite,
              std::uint64_t seed)
      : SensorDrive(std::move(scenario), VehicleParameters{}, speed, std::move(suite), seed) {}

  /// Likewise along a recorded motion; the scenario's route is then only its projection in the
  /// plan.
  SensorDrive(Scenario scenario, VehicleMotion motion, SensorSuite suite, std::uint64_t seed,
              model::Utime utime_of_start = 0);

  /// The next reading; none at the end of the drive.
  std::optional<SensorReading> next();

  /// The world of the drive.
  const World& world() const { return *scenario_.world; }
  /// The route driven.
  const Route& route() const { return scenario_.route; }
  /// The true motion.
  const VehicleMotion& motion() const { return motion_; }
  /// The sensors on board.
  const SensorSuite& suite() const { return suite_; }
  /// State of the vehicle at the time of a reading.
  VehicleState state_at(model::Utime utime) const {
    return motion_.at(1e-6 * static_cast<double>(utime - utime_of_start_));
  }
  /// Any revolution of the LIDAR (which must exist), the same whether or not next() returned it.
  SimulatedSweep sweep(std::uint64_t revolution) {
    return lidar_->sweep(motion_, revolution, utime_of_start_);
  }
  /// Whole revolutions of the LIDAR within the drive.
  std::uint64_t sweep_count() const;

 private:
  enum class Source { kTruth, kImu, kWheels, kGnss, kPlanarLaser, kLidar };
  struct Due {
    double time_s;
    Source source;
  };
  Due next_due() const;
  std::optional<SensorReading> read(Source source);

  Scenario scenario_;
  SensorSuite suite_;
  model::Utime utime_of_start_;
  VehicleMotion motion_;
  std::optional<SimulatedImu> imu_;
  std::optional<SimulatedWheels> wheels_;
  std::optional<SimulatedGnss> gnss_;
  std::unique_ptr<PlanarLaser> planar_laser_;
  std::unique_ptr<SpinningLidar> lidar_;
  std::uint64_t truths_ = 0;
  std::uint64_t scans_ = 0;
  std::uint64_t revolutions_ = 0;
};

}  // namespace understory::sim
