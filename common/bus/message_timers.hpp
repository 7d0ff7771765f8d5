// Ticks by message time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace understory::bus {

/// Calls handlers periodically. Time comes from the stamps of messages, so a replay makes the same
/// ticks as the live run.
class MessageTimers {
 public:
  /// Called with the time that is due [us].
  using Handler = std::function<void(std::int64_t due_us)>;

  /// Adds a timer. Its first tick is one period after the first fire(). Throws std::logic_error for
  /// a period that is not positive.
  void add(std::int64_t period_us, Handler handler);
  /// Calls all ticks due up to `now_us`, timer by timer, each tick once.
  void fire(std::int64_t now_us);
  /// Restarts all periods at the next fire(), after a jump of time.
  void start_over();

  /// Next due time of each timer [us], for a restart; -1 = not started.
  std::vector<std::int64_t> due_us() const;
  /// Restores the result of due_us(). Precondition: the same number of timers.
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
