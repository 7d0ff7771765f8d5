#include "common/bus/message_timers.hpp"

#include <stdexcept>
#include <utility>

namespace understory::bus {

void MessageTimers::add(std::int64_t period_us, Handler handler) {
  if (period_us <= 0) throw std::logic_error("a tick needs a period");
  timers_.push_back({period_us, -1, std::move(handler)});
}

void MessageTimers::fire(std::int64_t now_us) {
  // By index: a handler may add a timer.
  for (std::size_t i = 0; i < timers_.size(); ++i) {
    if (timers_[i].due_us < 0) timers_[i].due_us = now_us + timers_[i].period_us;
    while (timers_[i].due_us <= now_us) {
      const std::int64_t due_us = timers_[i].due_us;
      timers_[i].due_us += timers_[i].period_us;
      timers_[i].handler(due_us);
    }
  }
}

void MessageTimers::start_over() {
  for (Timer& timer : timers_) timer.due_us = -1;
}

std::vector<std::int64_t> MessageTimers::due_us() const {
  std::vector<std::int64_t> due_us;
  for (const Timer& timer : timers_) due_us.push_back(timer.due_us);
  return due_us;
}

void MessageTimers::resume(const std::vector<std::int64_t>& due_us) {
  for (std::size_t i = 0; i < timers_.size(); ++i) timers_[i].due_us = due_us.at(i);
}

}  // namespace understory::bus
