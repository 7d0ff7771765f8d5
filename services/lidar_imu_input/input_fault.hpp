// Faults of sensor messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace understory::lidar_imu_input {

/// Why a message was dropped, changed or not trusted.
enum class InputFaultKind : std::uint8_t {
  kNotFinite,  ///< NaN or infinite: dropped.
  kLate,       ///< Not after its predecessor: dropped.
  kClockJump,  ///< The sensor's clock jumped: quarantined, then followed.
  kPaused,  ///< All sensors were silent, or this process did not run: time has passed without data.
  kUnit,    ///< Values of another unit, which are converted.
  kSilent,  ///< No message for too long.
  kFrozen,  ///< The same value repeatedly.
  kSaturated,      ///< At the end of its range: omitted.
  kNoPointTimes,   ///< A sweep without point times.
  kNoMotion,       ///< A sweep that waited too long for motion: not de-skewed.
  kNotCalibrated,  ///< The vehicle moved before it had been stationary long enough.
};

/// One fault, for HEALTH.
struct InputFault {
  InputFaultKind kind = InputFaultKind::kLate;
  std::string channel;  ///< Of the faulty message.
  std::string text;     ///< For a person: the fault, and the stage's reaction.
};

/// The sensors whose clocks are monitored.
enum class Sensor : std::uint8_t { kImu, kWheels, kGnss, kSweep, kScan };
/// Number of sensors.
constexpr std::size_t kSensors = 5;
/// Default channel of a sensor: RAW_IMU and so on.
std::string channel_of(Sensor sensor);

}  // namespace understory::lidar_imu_input
