// When a process that died is started again.
#pragma once

#include <chrono>
#include <deque>

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
  milliseconds slow_retry{30'000};  ///< Wait after too many of them.
};

/// Short waits at first, since a vehicle is blind meanwhile; doubled with every death in the
/// window, so that a crash loop does not eat the processor. After too many deaths one try per
/// `slow_retry`: the cause (a full disk, say) may end during the drive.
class RestartPolicy {
 public:
  /// Without a death so far.
  explicit RestartPolicy(const RestartPolicyParameters& parameters = {})
      : parameters_(parameters) {}

  /// Counts the death of a process that lived for `lived`; gives how long to wait before the next
  /// start.
  milliseconds died(Clock::time_point now, Clock::duration lived);
  /// Trying again at once is useless: as if there had been too many deaths. Gives how long to wait.
  milliseconds give_up();
  /// Whether there were too many deaths; until a process has lived for a whole window.
  bool is_given_up() const { return is_given_up_; }
  /// A process that was given up has lived for a whole window: it counts as sound again.
  void forgive();
  /// Deaths within the window before the last one.
  std::size_t deaths_in_window() const { return deaths_.size(); }
  /// As given to the constructor.
  const RestartPolicyParameters& parameters() const { return parameters_; }

 private:
  RestartPolicyParameters parameters_;
  std::deque<Clock::time_point> deaths_;
  bool is_given_up_ = false;
};

}  // namespace understory::launch
