// Ticks by message time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace understory::bus {

/// Calls handlers at their periods. Time comes from the stamps of messages, so a replay ticks as
/// the live run did.
class MessageTimers {
 public:
  /// Called with the time that is due [us].
  using Handler = std::function<void(std::int64_t due_us)>;

  /// Adds a timer. Its first tick is one period behind the first fire(). Throws std::logic_error
  /// for a period that is not positive.
  void add(std::int64_t period_us, Handler handler);
  /// Calls everything that is due up to `now_us`, timer by timer, each tick of a period once.
  void fire(std::int64_t now_us);
  /// The periods begin anew at the next fire(): time has jumped.
  void start_over();

  /// When each timer is due [us], for a restart; -1 = it has not begun.
  std::vector<std::int64_t> due_us() const;
  /// Takes what due_us() gave. Precondition: as many timers as then.
  void resume(const std::vector<std::int64_t>& due_us);

 private:
  struct Timer {
    std::int64_t period_us = 0;
    std::int64_t due_us = -1;
    Handler handler;
  };

  std::vector<Timer> timers_;
};

}  // namespace understory::bus
