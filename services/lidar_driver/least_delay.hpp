// Offset of the computer's clock minus a sensor's, from the least delayed packets.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>

#include "common/model/landmarks.hpp"

namespace understory::lidar_driver {

/// The least difference of the last ten to twenty seconds: packets can be late, but never early.
class LeastDelay {
 public:
  /// Adds a packet with `utime` by the sensor's clock, received at `received` by the computer's
  /// [us].
  void add(model::Utime utime, model::Utime received) {
    const model::Utime period = utime / kPeriod_us;
    if (period != period_) {
      before_ = now_;
      now_ = kNone;
      period_ = period;
    }
    now_ = std::min(now_, received - utime);
  }
  /// The sensor's clock was set.
  void forget() { now_ = before_ = kNone; }
  /// [us]; none before the first packet.
  std::optional<model::Utime> offset_us() const {
    const model::Utime least = std::min(now_, before_);
    if (least == kNone) return std::nullopt;
    return least;
  }

 private:
  static constexpr model::Utime kPeriod_us = 10'000'000;
  static constexpr model::Utime kNone = std::numeric_limits<model::Utime>::max();
  model::Utime now_ = kNone;     ///< Least of this period.
  model::Utime before_ = kNone;  ///< Least of the previous period.
  model::Utime period_ = 0;
};

}  // namespace understory::lidar_driver
