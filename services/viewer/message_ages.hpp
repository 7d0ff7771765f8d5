// Age of messages at their reception.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "common/model/landmarks.hpp"

namespace understory::viewer {

/// Compares stamps with the wall clock at their reception. The least difference, of a fast sensor
/// in the last 10 to 20 s, is the offset of the clocks, not an age.
class MessageAges {
 public:
  /// Adds a message and its reception time [us].
  void note(model::Utime utime, std::int64_t wall_us) {
    note(utime);
    newest_wall_us_ = std::max(newest_wall_us_, wall_us);
  }
  /// Adds a message without its reception time.
  void note(model::Utime utime) { utime_ = std::max(utime_, utime); }
  /// Adds a stamp of a fast sensor.
  void note_stamp(model::Utime utime, std::int64_t wall_us);
  /// Age of a message received now; none before the first stamp.
  std::optional<double> age_ms(model::Utime utime, std::int64_t wall_us) const;
  /// Removes all.
  void clear() { *this = {}; }

  /// Newest stamp, -1 before the first.
  model::Utime utime() const { return utime_; }
  /// Wall clock of the newest message [us].
  std::int64_t newest_wall_us() const { return newest_wall_us_; }

 private:
  model::Utime utime_ = -1;
  std::int64_t newest_wall_us_ = 0;
  /// Least difference of wall clock to stamp in this period and the one before [us].
  std::array<std::optional<std::int64_t>, 2> least_us_;
  std::int64_t period_us_ = 0;
};

}  // namespace understory::viewer
