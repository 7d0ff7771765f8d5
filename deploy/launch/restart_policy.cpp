#include "deploy/launch/restart_policy.hpp"

#include <algorithm>

namespace understory::launch {

std::optional<milliseconds> RestartPolicy::died(Clock::time_point now) {
  while (!deaths_.empty() && now - deaths_.front() > parameters_.window) deaths_.pop_front();
  deaths_.push_back(now);
  if (deaths_.size() >= parameters_.max_deaths) return std::nullopt;
  milliseconds backoff = parameters_.first_backoff;
  for (std::size_t i = 1; i < deaths_.size() && backoff < parameters_.max_backoff; ++i) {
    backoff *= 2;
  }
  return std::min(backoff, parameters_.max_backoff);
}

}  // namespace understory::launch
