// When a process that died is started again, and when not.
#pragma once

#include <chrono>
#include <deque>
#include <optional>

namespace understory::launch {

/// The supervisor's clock: never goes back.
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;  ///< The unit of all its times.

/// Waiting times and the limit of deaths.
struct RestartPolicyParameters {
  milliseconds first_backoff{10};
  milliseconds max_backoff{1000};
  std::size_t max_deaths = 5;  ///< Within `window` they are too many.
  milliseconds window{30'000};
};

/// Short waits at first, since a vehicle is blind meanwhile; doubled with every death in the
/// window, so that a crash loop does not eat the processor.
class RestartPolicy {
 public:
  /// Without a death so far.
  explicit RestartPolicy(const RestartPolicyParameters& parameters = {})
      : parameters_(parameters) {}

  /// Counts a death; gives how long to wait before the next start, or none: give up.
  std::optional<milliseconds> died(Clock::time_point now);
  /// Deaths within the window before the last one.
  std::size_t deaths_in_window() const { return deaths_.size(); }
  /// As given to the constructor.
  const RestartPolicyParameters& parameters() const { return parameters_; }

 private:
  RestartPolicyParameters parameters_;
  std::deque<Clock::time_point> deaths_;
};

}  // namespace understory::launch
