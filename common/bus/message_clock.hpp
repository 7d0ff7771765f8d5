// The time of a service: the newest stamp of what it takes in.
#pragma once

#include <cstdint>

namespace understory::bus {

/// Follows the newest stamp. A stamp far from it is not believed until several in a row agree: one
/// wrong stamp must neither stop the service nor make everything after it look old.
class MessageClock {
 public:
  /// What take() did with a stamp: believed it, waits for proof, or jumped to it.
  enum class Verdict : std::uint8_t { kFine, kQuarantined, kJumped };

  /// `largest_jump_us`: a stamp farther than this from now() needs proof.
  explicit MessageClock(std::int64_t largest_jump_us) : largest_jump_us_(largest_jump_us) {}

  /// Takes the stamp of a message [us]. kJumped: three stamps in a row agreed, and now() is the
  /// last of them.
  Verdict take(std::int64_t utime);
  /// Newest believed stamp [us]; -1 before the first.
  std::int64_t now() const { return now_; }
  /// Sets now(), for a restart.
  void resume(std::int64_t now) { now_ = now; }

 private:
  static constexpr int kAgreeing = 3;

  std::int64_t largest_jump_us_;
  std::int64_t now_ = -1;
  std::int64_t candidate_ = 0;
  int agreeing_ = 0;
};

}  // namespace understory::bus
