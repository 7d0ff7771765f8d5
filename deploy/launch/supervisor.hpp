// Starts processes, detects deaths and hangs, restarts processes, and stops all cleanly.
//
// It has no loop and no clock of its own: the caller polls the descriptors and calls step() with
// the time. The same object runs in `understory launch` and in tests.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "deploy/launch/child_process.hpp"
#include "deploy/launch/restart_policy.hpp"

namespace understory::launch {

/// A process to run.
struct ProcessSpec {
  std::string name;  ///< As in its HEALTH messages.
  Command command;
  bool sends_health = true;  ///< False: missing HEALTH has no meaning.
  /// It is stopped after all others, because it records their last messages.
  bool ends_last = false;
};

/// A stopped process (SIGSTOP) is detected in /proc within a tenth of a second, hence the short
/// times. Any other hang appears only as missing HEALTH, which is published once a second: three
/// missing are DEGRADED, five are a hang. Fewer would restart healthy processes on a busy computer.
/// A process that never sent HEALTH is DEGRADED, but not killed.
///
/// Time in which the supervisor itself did not run (stopped, or the computer was suspended or
/// overloaded) does not count as silence: all these times are extended by it.
struct SupervisorParameters {
  RestartPolicyParameters restart;
  milliseconds stopped_degraded{300};
  milliseconds stopped_restart{1000};
  milliseconds silent_degraded{3000};
  milliseconds silent_restart{5000};
  milliseconds never_heard_degraded{10000};  ///< Since its start.
  milliseconds stop_timeout{900};            ///< From SIGTERM to SIGKILL.
  /// Longest interval between checks, because no descriptor shows a hang.
  milliseconds look_every{100};
  /// A longer time between two steps means that the supervisor did not run.
  milliseconds pause{300};
};

/// State of a process. A given-up process is tried again from time to time.
enum class ProcessState { kWaiting, kRunning, kDegraded, kFinished, kGivenUp };
/// "waiting", "running", "degraded", "finished", "given up".
const char* to_string(ProcessState state);

/// Status of a process, for reports and for the registry.
struct ProcessStatus {
  std::string name;
  ProcessState state = ProcessState::kWaiting;
  pid_t pid = -1;
  std::uint64_t start_ticks = 0;
  std::uint64_t restarts = 0;
  std::string last_ending;   ///< Empty before the first death.
  bool is_given_up = false;  ///< Too many deaths; ends when it has run for a whole window.
};

/// All processes of a launch.
class Supervisor {
 public:
  /// Called with one line for every event: (process, text).
  using Report = std::function<void(const std::string&, const std::string&)>;
  /// Starts nothing yet.
  Supervisor(std::vector<ProcessSpec> specs, const SupervisorParameters& parameters, Report report);

  /// Takes over those of `known` that still run, and starts the others; counts of restarts
  /// continue.
  void start(const std::vector<ProcessStatus>& known, Clock::time_point now);
  /// A HEALTH message of a process; a message with another pid than the running process is ignored.
  void heartbeat(const std::string& name, pid_t pid, Clock::time_point now);
  /// Detects deaths and hangs, starts due processes. Cheap; call it whenever a descriptor is ready
  /// and at the latest at wake_up(), after heartbeat() for all waiting HEALTH.
  void step(Clock::time_point now);
  /// Asks every process to end, those with `ends_last` after the others; continue to call step()
  /// until stopped().
  void stop(Clock::time_point now);

  /// True after stop().
  bool stopping() const { return stop_time_.has_value(); }
  bool stopped() const;  ///< No process runs and none will be started.
  /// Readable when a process has ended: for poll().
  std::vector<int> descriptors() const;
  /// Latest time of the next step().
  Clock::time_point wake_up(Clock::time_point now) const;
  /// One per process, in the order of the specs.
  std::vector<ProcessStatus> status() const;
  /// Processes that refused at their first start (exit status 2: wrong configuration).
  const std::vector<std::string>& refused() const { return refused_; }

 private:
  struct Entry {
    ProcessSpec spec;
    RestartPolicy policy;
    ProcessState state = ProcessState::kWaiting;
    std::optional<ChildProcess> child;
    std::optional<Clock::time_point> start_due;
    Clock::time_point started;
    Clock::time_point listened_since;  ///< Its start, plus the supervisor's pauses since then.
    Clock::time_point died;
    std::optional<Clock::time_point> last_heartbeat;
    std::optional<Clock::time_point> stopped_since;
    std::uint64_t starts = 0;
    std::string last_ending;
  };

  void launch(Entry& entry, Clock::time_point now);
  void cannot_start(Entry& entry, const std::string& why, Clock::time_point now);
  void count_pause(Clock::time_point now);
  void ask_to_end(bool last, Clock::time_point now);
  void kill_late(Clock::time_point now);
  bool others_run() const;
  void bury(Entry& entry, const Ending& ending, Clock::time_point now);
  void schedule_restart(Entry& entry, milliseconds wait, Clock::time_point now);
  void restart_after_death(Entry& entry, Clock::time_point now);
  void forgive_survivor(Entry& entry, Clock::time_point now);
  void watch(Entry& entry, Clock::time_point now);

  std::vector<Entry> entries_;
  SupervisorParameters parameters_;
  Report report_;
  std::optional<Clock::time_point> stepped_;    ///< Time of the last step.
  std::optional<Clock::time_point> stop_time_;  ///< Time of the last request to end.
  bool last_are_asked_ = false;                 ///< The processes with `ends_last` were asked too.
  bool killed_ = false;                         ///< A process was late and was killed.
  std::vector<std::string> refused_;
};

}  // namespace understory::launch
