// The time of a service: the newest stamp of its inputs.
#pragma once

#include <cstdint>
#include <limits>

namespace understory::bus {

/// The stamps of one channel so far, as evidence for its next one [us].
struct ChannelPace {
  /// Value for a stamp of an unknown channel: there is no evidence for it.
  static constexpr std::int64_t kUnknown = std::numeric_limits<std::int64_t>::max();

  std::int64_t newest_us = kUnknown;  ///< Newest believed stamp; -1 = this is the first.
  std::int64_t interval_us = 0;       ///< Interval between the last two believed stamps.

  /// Takes the next believed stamp.
  void take(std::int64_t utime) {
    interval_us = newest_us < 0 || utime < newest_us ? 0 : utime - newest_us;
    newest_us = utime;
  }
};

/// Follows the newest stamp. A stamp far from it is not believed until several in succession agree:
/// one wrong stamp must neither stop the service nor make later messages look old.
///
/// A pause may have any length: a vehicle may stop for hours, and a slow one makes one keyframe per
/// minute. An earlier stamp (a keyframe has the stamp of its first scan) is believed if it is in
/// order on its own channel. A later stamp is believed if its channel is that slow or if further
/// stamps continue from it.
class MessageClock {
 public:
  /// The decision of take() on a stamp.
  enum class Verdict : std::uint8_t {
    kFine,         ///< Believed.
    kQuarantined,  ///< Waits for proof; the messages that waited before were wrong.
    kAgrees,       ///< Waits too, and agrees with the waiting ones.
    kJumped,  ///< Three in succession agreed, or one at its channel's interval: all are believed,
              ///< and now() is this stamp.
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
  /// If this many messages in succession, each in order on its channel, are far behind now(), then
  /// now() is wrong.
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
