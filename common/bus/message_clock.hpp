// The time of a service: the newest stamp of what it takes in.
#pragma once

#include <cstdint>
#include <limits>

namespace understory::bus {

/// The stamps of one channel so far, as evidence for its next one [us].
struct ChannelPace {
  /// Of a stamp whose channel nobody knows: nothing speaks for it.
  static constexpr std::int64_t kUnknown = std::numeric_limits<std::int64_t>::max();

  std::int64_t newest_us = kUnknown;  ///< Newest believed stamp; -1 = this is the first.
  std::int64_t interval_us = 0;       ///< Between the last two.

  /// The next believed stamp.
  void take(std::int64_t utime) {
    interval_us = newest_us < 0 || utime < newest_us ? 0 : utime - newest_us;
    newest_us = utime;
  }
};

/// Follows the newest stamp. A stamp far from it is not believed until several in a row agree: one
/// wrong stamp must neither stop the service nor make everything after it look old.
///
/// How long a pause may be has no limit: a vehicle may stop for hours, and a slow one gives a
/// keyframe a minute. What lies behind (a keyframe has the stamp of its first scan) is believed
/// where it is in order on its own channel, and what lies ahead where its channel is that slow or
/// time goes on from there.
class MessageClock {
 public:
  /// What take() did with a stamp.
  enum class Verdict : std::uint8_t {
    kFine,         ///< Believed.
    kQuarantined,  ///< Waits for proof; the ones that waited before it were wrong.
    kAgrees,       ///< Waits, too, and speaks for those that wait.
    kJumped,  ///< Three in a row agreed, or one at its channel's pace: all are believed, and now()
              ///< is this one.
  };

  /// `largest_jump_us`: a stamp farther than this from now() needs proof.
  explicit MessageClock(std::int64_t largest_jump_us) : largest_jump_us_(largest_jump_us) {}

  /// Takes the stamp of a message [us].
  Verdict take(std::int64_t utime, const ChannelPace& pace = {});
  /// Newest believed stamp [us]; -1 before the first.
  std::int64_t now() const { return now_; }
  /// Whether a stamp waits for proof.
  bool is_waiting() const { return agreeing_ > 0; }
  /// Sets now(), for a restart.
  void resume(std::int64_t now);

 private:
  static constexpr int kAgreeing = 3;
  /// Messages in a row, each in order on its channel, far behind now(): then that is wrong.
  static constexpr int kBehind = 32;

  bool agrees(std::int64_t utime) const;
  Verdict take_behind(std::int64_t utime);
  Verdict take_far(std::int64_t utime);

  std::int64_t largest_jump_us_;
  std::int64_t now_ = -1;
  std::int64_t candidate_ = 0;
  int agreeing_ = 0;
  int behind_ = 0;
};

}  // namespace understory::bus
