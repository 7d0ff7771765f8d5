#include "common/bus/message_clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace understory::bus {
namespace {

/// A channel's stamp may be this many of its intervals ahead; so may a stamp that agrees be of the
/// pause that it speaks for.
constexpr std::int64_t kIntervals = 3;
/// A day [us]: a pause beyond it says nothing about the pace.
constexpr std::int64_t kLongestInterval_us = 86'400'000'000;

}  // namespace

MessageClock::Verdict MessageClock::take(std::int64_t utime, const ChannelPace& pace) {
  const std::int64_t paced_us = kIntervals * std::min(pace.interval_us, kLongestInterval_us);
  const bool is_near = utime <= now_ ? now_ - utime <= largest_jump_us_
                                     : utime - now_ <= std::max(largest_jump_us_, paced_us);
  // A slow channel that goes on at its pace proves those that have waited where it is now.
  if (now_ >= 0 && is_near && utime - now_ > largest_jump_us_ && agrees(utime)) {
    resume(utime);
    return Verdict::kJumped;
  }
  if (now_ < 0 || is_near) {
    // Time goes on from where it was: what waited was wrong.
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

/// Whether time goes on from the candidate: near it or, after a pause, as much later again.
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
