// Decides when a dead process is restarted.
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
  std::size_t max_deaths = 5;  ///< This many within `window` are too many.
  milliseconds window{30'000};
  milliseconds slow_retry{30'000};  ///< Wait after too many of them.
};

/// Waits are short at first, because the vehicle lacks the process meanwhile; they double with
/// every death in the window, so that a crash loop does not use the processor. After too many
/// deaths there is one try per `slow_retry`, because the cause (e.g. a full disk) may end during
/// the drive.
class RestartPolicy {
 public:
  /// Starts without deaths.
  explicit RestartPolicy(const RestartPolicyParameters& parameters = {})
      : parameters_(parameters) {}

  /// Counts the death of a process that lived for `lived`; returns the time to wait before the next
  /// start.
  milliseconds died(Clock::time_point now, Clock::duration lived);
  /// Call it if an immediate retry is useless: acts like too many deaths. Returns the time to wait.
  milliseconds give_up();
  /// Whether there were too many deaths; false again when a process has run for a whole window.
  bool is_given_up() const { return is_given_up_; }
  /// Call it when a given-up process has run for a whole window: it is no longer given up.
  void forgive();
  /// Deaths within the window before the last one.
  std::size_t deaths_in_window() const { return deaths_.size(); }
  /// The parameters given to the constructor.
  const RestartPolicyParameters& parameters() const { return parameters_; }

 private:
  RestartPolicyParameters parameters_;
  std::deque<Clock::time_point> deaths_;
  bool is_given_up_ = false;
};

}  // namespace understory::launch
