#include "common/bus/message_clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace understory::bus {

MessageClock::Verdict MessageClock::take(std::int64_t utime) {
  if (now_ < 0 || std::abs(utime - now_) <= largest_jump_us_) {
    now_ = std::max(now_, utime);
    agreeing_ = 0;
    return Verdict::kFine;
  }
  const bool agrees = agreeing_ > 0 && std::abs(utime - candidate_) <= largest_jump_us_;
  agreeing_ = agrees ? agreeing_ + 1 : 1;
  candidate_ = utime;
  if (agreeing_ < kAgreeing) return Verdict::kQuarantined;
  now_ = utime;
  agreeing_ = 0;
  return Verdict::kJumped;
}

}  // namespace understory::bus
