// Relates a sensor's clock to the computer's.
#pragma once

#include <cstdint>
#include <optional>

#include "common/model/landmarks.hpp"

namespace understory::packets {

/// A sensor synchronised by PTP or GNSS sends the time of day, perhaps as TAI, which is 37 s ahead
/// of UTC: its times are used unchanged. The times of a sensor that counts from power-on are
/// shifted by a constant, so that its first packet has its reception time. This is decided at the
/// first packet and again when the sensor's clock is set.
class SensorClock {
 public:
  /// Relation of a packet's time to the previous one.
  enum class Step : std::uint8_t {
    kNext,
    kJump,  ///< The two clocks advanced differently: one of them was set.
  };
  /// Takes the time of a packet [ns, sensor's clock; 0 to kLatest_ns] and its reception time [us].
  Step take(std::int64_t sensor_ns, model::Utime received);
  /// Converts a time of the sensor's clock to the computer's [ns since 1970].
  std::int64_t placed_ns(std::int64_t sensor_ns) const { return sensor_ns + moved_ns_; }
  /// Shift of the sensor's times [ns]; 0 = used unchanged.
  std::int64_t moved_ns() const { return moved_ns_; }
  /// The computer's clock minus the converted time at the last packet [us]: delay plus difference
  /// of the clocks. None before the first packet.
  std::optional<model::Utime> lag_us() const { return lag_us_; }

  /// Latest valid time: the year 2096.
  static constexpr std::int64_t kLatest_ns = 4'000'000'000'000'000'000;
  /// If the clocks differ by less than this, the sensor sends the time of day.
  static constexpr std::int64_t kSameTime_ns = 600'000'000'000;
  /// Largest difference of the time between two packets on the sensor's and on the computer's
  /// clock.
  static constexpr std::int64_t kLargestMismatch_ns = 1'000'000'000;

 private:
  void place(std::int64_t sensor_ns, std::int64_t received_ns);

  bool has_started_ = false;
  std::int64_t sensor_ns_ = 0;  ///< Time of the last packet.
  std::int64_t received_ns_ = 0;
  std::int64_t moved_ns_ = 0;
  std::optional<model::Utime> lag_us_;
};

}  // namespace understory::packets
