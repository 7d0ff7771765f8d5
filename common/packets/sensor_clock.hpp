// A sensor's own clock, laid onto the computer's.
#pragma once

#include <cstdint>
#include <optional>

#include "common/model/landmarks.hpp"

namespace understory::packets {

/// A sensor that is set by PTP or by GNSS gives the time of day, perhaps as TAI, which is 37 s
/// ahead of UTC: its times are taken as they are. One that counts from when it was switched on is
/// moved by a constant, so that its first packet has the time at which it was received. One
/// process: the decision is made at the first packet and again when the sensor's clock is set.
class SensorClock {
 public:
  /// How a packet's time follows that of the one before.
  enum class Step : std::uint8_t {
    kNext,
    kJump,  ///< The two clocks did not advance alike: one of them was set.
  };
  /// Takes the time of a packet [ns, sensor's clock; 0 to kLatest_ns] and when it was received
  /// [us].
  Step take(std::int64_t sensor_ns, model::Utime received);
  /// A time of the sensor's clock on the computer's [ns since 1970].
  std::int64_t placed_ns(std::int64_t sensor_ns) const { return sensor_ns + moved_ns_; }
  /// By how much the sensor's times are moved [ns]; 0 where they are taken as they are.
  std::int64_t moved_ns() const { return moved_ns_; }
  /// The computer's clock less the placed times, at the last packet [us]: its delay, and how far
  /// the clocks differ. None before the first packet.
  std::optional<model::Utime> lag_us() const { return lag_us_; }

  /// A later time is none: the year 2096.
  static constexpr std::int64_t kLatest_ns = 4'000'000'000'000'000'000;
  /// Clocks that are nearer to each other than this show the time of day.
  static constexpr std::int64_t kSameTime_ns = 600'000'000'000;
  /// Sensor's and computer's clock may differ so much in what passed between two packets.
  static constexpr std::int64_t kLargestMismatch_ns = 1'000'000'000;

 private:
  void place(std::int64_t sensor_ns, std::int64_t received_ns);

  bool has_started_ = false;
  std::int64_t sensor_ns_ = 0;  ///< Of the last packet.
  std::int64_t received_ns_ = 0;
  std::int64_t moved_ns_ = 0;
  std::optional<model::Utime> lag_us_;
};

}  // namespace understory::packets
