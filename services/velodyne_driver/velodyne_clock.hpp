// The sensor's clock: from microseconds past the hour to stamps that advance.
#pragma once

#include <cstdint>
#include <optional>

#include "common/model/landmarks.hpp"
#include "services/lidar_driver/least_delay.hpp"

namespace understory::velodyne_driver {

/// The first packet's time is put into the hour in which it is nearest to its reception; from then
/// on differences are added, so an offset of the sensor's clock of half an hour never changes the
/// hour during a run.
class VelodyneClock {
 public:
  /// Relation of a packet's time to the previous packet's.
  enum class Step : std::uint8_t {
    kNext,  ///< In order.
    kGap,   ///< More time has passed than between two packets.
    kLate,  ///< Before the last one by less than kLargestDisorder_us; the clock stays.
    kJump,  ///< The sensor's clock was set, or the sensor started again.
  };
  /// The time of one packet.
  struct Reading {
    Step step = Step::kNext;
    model::Utime utime = 0;  ///< By the sensor's clock.
  };
  /// Adds a packet's time [us past the hour] and its reception time by the computer's clock.
  Reading take(std::uint32_t past_hour_us, model::Utime received);
  /// Offset of the computer's clock minus the sensor's: the least (of the least delayed packet) in
  /// the last ten to twenty seconds [us]; none before the first packet.
  std::optional<model::Utime> offset_us() const { return delay_.offset_us(); }

  static constexpr model::Utime kLargestGap_us = 50000;  ///< A longer one is kGap.
  static constexpr model::Utime kLargestDisorder_us =
      20000;  ///< A shorter one, back in time, is kLate.

 private:
  void put_into_hour(std::uint32_t past_hour_us, model::Utime received);
  bool has_started_ = false;
  model::Utime utime_ = 0;
  std::uint32_t past_hour_us_ = 0;
  model::Utime received_ = 0;
  lidar_driver::LeastDelay delay_;
};

}  // namespace understory::velodyne_driver
