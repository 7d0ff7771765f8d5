#include "deploy/launch/restart_policy.hpp"

#include <algorithm>

namespace understory::launch {

milliseconds RestartPolicy::died(Clock::time_point now, Clock::duration lived) {
  if (lived >= parameters_.window) forgive();
  while (!deaths_.empty() && now - deaths_.front() > parameters_.window) deaths_.pop_front();
  deaths_.push_back(now);
  if (is_given_up_ || deaths_.size() >= parameters_.max_deaths) return give_up();

  milliseconds backoff = parameters_.first_backoff;
  for (std::size_t i = 1; i < deaths_.size() && backoff < parameters_.max_backoff; ++i) {
    backoff *= 2;
  }
  return std::min(backoff, parameters_.max_backoff);
}

milliseconds RestartPolicy::give_up() {
  is_given_up_ = true;
  return parameters_.slow_retry;
}

void RestartPolicy::forgive() {
  is_given_up_ = false;
  deaths_.clear();
}

}  // namespace understory::launch
