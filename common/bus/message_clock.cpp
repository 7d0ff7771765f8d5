#include "common/bus/message_clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace understory::bus {
namespace {

/// A channel's stamp may be ahead by this many of its intervals; a stamp that agrees, by this many
/// times the pause.
constexpr std::int64_t kIntervals = 3;
/// A day [us]: a longer pause is no evidence of the channel's interval.
constexpr std::int64_t kLongestInterval_us = 86'400'000'000;

}  // namespace

MessageClock::Verdict MessageClock::take(std::int64_t utime, const ChannelPace& pace) {
  const std::int64_t paced_us = kIntervals * std::min(pace.interval_us, kLongestInterval_us);
  const bool is_near = utime <= now_ ? now_ - utime <= largest_jump_us_
                                     : utime - now_ <= std::max(largest_jump_us_, paced_us);
  // A slow channel that continues at its interval proves the waiting stamps near its new stamp.
  if (now_ >= 0 && is_near && utime - now_ > largest_jump_us_ && agrees(utime)) {
    resume(utime);
    return Verdict::kJumped;
  }
  if (now_ < 0 || is_near) {
    // Time continues from now_: the waiting stamps were wrong.
    if (utime > now_) agreeing_ = 0;
    behind_ = 0;
    now_ = std::max(now_, utime);
    return Verdict::kFine;
  }
  if (utime < now_ && utime > pace.newest_us) return take_behind(utime);
  return take_far(utime);
}

MessageClock::Verdict MessageClock::take_behind(std::int64_t utime) {
  if (++behind_ < kBehind) return Verdict::kFine;
  resume(utime);
  return Verdict::kJumped;
}

MessageClock::Verdict MessageClock::take_far(std::int64_t utime) {
  const bool is_alone = !agrees(utime);
  agreeing_ = is_alone ? 1 : agreeing_ + 1;
  candidate_ = utime;
  if (is_alone) return Verdict::kQuarantined;
  if (agreeing_ < kAgreeing) return Verdict::kAgrees;
  resume(utime);
  return Verdict::kJumped;
}

/// Whether the stamp continues from the candidate: near it or, after a pause, up to kIntervals
/// pauses later.
bool MessageClock::agrees(std::int64_t utime) const {
  if (agreeing_ == 0) return false;
  const std::int64_t pause_us = std::min(candidate_ - now_, kLongestInterval_us);
  return utime - candidate_ >= -largest_jump_us_ &&
         utime - candidate_ <= std::max(largest_jump_us_, kIntervals * pause_us);
}

void MessageClock::resume(std::int64_t now) {
  now_ = now;
  agreeing_ = 0;
  behind_ = 0;
}

}  // namespace understory::bus
