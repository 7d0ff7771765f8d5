// What can be wrong with a sensor's messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace understory::lidar_imu_input {

/// Why a message was dropped, changed or not believed.
enum class InputFaultKind : std::uint8_t {
  kNotFinite,      ///< NaN or infinite: dropped.
  kLate,           ///< Not after its predecessor: dropped.
  kClockJump,      ///< The sensor's clock jumped: quarantined, then followed.
  kPaused,         ///< All sensors were silent, or this process did not run: time went on without.
  kUnit,           ///< Values of another unit, which are converted.
  kSilent,         ///< Nothing came for too long.
  kFrozen,         ///< The same value again and again.
  kSaturated,      ///< At the end of its range: left out.
  kNoPointTimes,   ///< A sweep whose points have no times.
  kNoMotion,       ///< A sweep that could not wait for motion any longer: not de-skewed.
  kNotCalibrated,  ///< The vehicle moved before it had been stationary long enough.
};

/// One fault, as HEALTH reports it.
struct InputFault {
  InputFaultKind kind = InputFaultKind::kLate;
  std::string channel;  ///< Of the message that it is about.
  std::string text;     ///< For a person: what happened, what the stage does about it.
};

/// The sensors whose clocks are watched.
enum class Sensor : std::uint8_t { kImu, kWheels, kGnss, kSweep, kScan };
/// How many they are.
constexpr std::size_t kSensors = 5;
/// Default channel of a sensor: RAW_IMU and so on.
std::string channel_of(Sensor sensor);

}  // namespace understory::lidar_imu_input
