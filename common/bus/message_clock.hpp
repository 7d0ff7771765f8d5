// The time by which a service lives: the stamps of what it takes in.
#pragma once

#include <cstdint>

namespace understory::bus {

/// Follows the newest stamp. A stamp far from it is not believed until several in a row agree: one
/// wrong stamp must neither stop the service nor make everything after it look old.
class MessageClock {
 public:
  enum class Verdict : std::uint8_t { kFine, kQuarantined, kJumped };

  explicit MessageClock(std::int64_t largest_jump_us) : largest_jump_us_(largest_jump_us) {}

  /// kJumped: it agreed with the ones before it, and the clock now stands there.
  Verdict take(std::int64_t utime);
  /// Newest believed stamp [us]; -1 before the first.
  std::int64_t now() const { return now_; }
  void resume(std::int64_t now) { now_ = now; }

 private:
  static constexpr int kAgreeing = 3;

  std::int64_t largest_jump_us_;
  std::int64_t now_ = -1;
  std::int64_t candidate_ = 0;
  int agreeing_ = 0;
};

}  // namespace understory::bus
