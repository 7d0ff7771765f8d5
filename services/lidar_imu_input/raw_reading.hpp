// One message of a sensor, as received from the bus.
#pragma once

#include <concepts>
#include <stdexcept>
#include <variant>

#include "common/model/archive.hpp"
#include "services/lidar_imu_input/deskew.hpp"
#include "services/lidar_imu_input/input_fault.hpp"

namespace understory::lidar_imu_input {

/// RAW_IMU, RAW_WHEELS, RAW_GNSS, RAW_SWEEP (a whole revolution) or RAW_SCAN, frame sensor: in the
/// order of `Sensor`.
using RawReading = std::variant<model::ImuSample, model::WheelSample, model::GnssFix,
                                model::PointSweep, model::PlanarScan>;

/// The sensor of a reading.
inline Sensor sensor_of(const RawReading& reading) { return static_cast<Sensor>(reading.index()); }
/// Its stamp on the sensor's own clock.
inline model::Utime stamp_of(const RawReading& reading) {
  return std::visit([](const auto& value) { return value.utime; }, reading);
}
/// Time of its completion: the end of a revolution, else its stamp.
inline model::Utime end_of(const RawReading& reading) {
  if (const auto* sweep = std::get_if<model::PointSweep>(&reading))
    return end_of_revolution(*sweep);
  if (const auto* scan = std::get_if<model::PlanarScan>(&reading)) return scan->end();
  return stamp_of(reading);
}
/// Its sender's sequence number.
inline std::uint64_t sequence_of(const RawReading& reading) {
  return std::visit([](const auto& value) { return value.sequence; }, reading);
}

/// An empty reading of the sensor. Throws std::invalid_argument for an invalid number of a sensor.
inline RawReading empty_reading(Sensor sensor) {
  switch (sensor) {
    case Sensor::kImu:
      return model::ImuSample{};
    case Sensor::kWheels:
      return model::WheelSample{};
    case Sensor::kGnss:
      return model::GnssFix{};
    case Sensor::kSweep:
      return model::PointSweep{};
    case Sensor::kScan:
      return model::PlanarScan{};
    default:
      throw std::invalid_argument("state: a reading of no known sensor waits");
  }
}

/// A waiting reading; saved without the points of sweeps, which are bulk data.
struct HeldReading {
  RawReading reading;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    auto kind = static_cast<std::uint8_t>(self.reading.index());
    a(kind);
    if constexpr (Archive::kReads) self.reading = empty_reading(static_cast<Sensor>(kind));
    std::visit(
        [&a](auto& value) {
          using Value = std::remove_cvref_t<decltype(value)>;
          if constexpr (!std::same_as<Value, model::PointSweep>) a(value);
        },
        self.reading);
  }
};

}  // namespace understory::lidar_imu_input
