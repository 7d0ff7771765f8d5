// Starts processes, notices when one dies or hangs, starts it again, stops all cleanly.
//
// It has no loop and no clock of its own: the caller polls the descriptors and calls step() with
// the time. So the same object runs in `understory launch` and in tests.
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
  bool sends_health = true;  ///< False: not having heard it says nothing.
  bool ends_last = false;  ///< It is asked to end when all others have: it keeps their last words.
};

/// A process that is stopped (SIGSTOP) is noticed in /proc within a tenth of a second, hence the
/// short times. Any other hang shows only as missing HEALTH, which comes once a second: three
/// missed are DEGRADED, five a hang. Fewer would restart healthy processes on a busy computer. A
/// process that was never heard is DEGRADED, but not killed.
///
/// Time in which the supervisor itself did not run (it was stopped, the computer was suspended or
/// overloaded) is no silence of a process: all these times are extended by it.
struct SupervisorParameters {
  RestartPolicyParameters restart;
  milliseconds stopped_degraded{300};
  milliseconds stopped_restart{1000};
  milliseconds silent_degraded{3000};
  milliseconds silent_restart{5000};
  milliseconds never_heard_degraded{10000};  ///< Since its start.
  milliseconds stop_timeout{900};            ///< From SIGTERM to SIGKILL.
  milliseconds look_every{100};              ///< At the latest; hangs show in no descriptor.
  milliseconds pause{300};                   ///< Longer between two steps: it did not run.
};

/// What a process is doing. One that is given up is tried again from time to time.
enum class ProcessState { kWaiting, kRunning, kDegraded, kFinished, kGivenUp };
/// "waiting", "running", "degraded", "finished", "given up".
const char* to_string(ProcessState state);

/// How a process is, for reports and for the registry.
struct ProcessStatus {
  std::string name;
  ProcessState state = ProcessState::kWaiting;
  pid_t pid = -1;
  std::uint64_t start_ticks = 0;
  std::uint64_t restarts = 0;
  std::string last_ending;   ///< Empty before the first death.
  bool is_given_up = false;  ///< Too many deaths; until it has run for a whole window.
};

/// All processes of a launch.
class Supervisor {
 public:
  /// Called with one line for everything that happens: (process, text).
  using Report = std::function<void(const std::string&, const std::string&)>;
  /// Starts nothing yet.
  Supervisor(std::vector<ProcessSpec> specs, const SupervisorParameters& parameters, Report report);

  /// Takes over those of `known` that still run, starts the others; restarts go on being counted.
  void start(const std::vector<ProcessStatus>& known, Clock::time_point now);
  /// A HEALTH message of a process; one of another pid than that of the running process is not
  /// counted.
  void heartbeat(const std::string& name, pid_t pid, Clock::time_point now);
  /// Notices deaths and hangs, starts what is due. Cheap; to be called whenever a descriptor is
  /// ready and at the latest at wake_up(), after heartbeat() for all HEALTH that waits.
  void step(Clock::time_point now);
  /// Asks every process to end, those that end last when the others have; step() goes on until
  /// stopped().
  void stop(Clock::time_point now);

  /// True after stop().
  bool stopping() const { return stop_time_.has_value(); }
  bool stopped() const;  ///< No process runs and none will be started.
  /// Readable when a process has ended: for poll().
  std::vector<int> descriptors() const;
  /// When step() must be called at the latest.
  Clock::time_point wake_up(Clock::time_point now) const;
  /// One per process, in the order of the specs.
  std::vector<ProcessStatus> status() const;
  /// Processes that were refused at their first start (exit status 2: wrong configuration).
  const std::vector<std::string>& refused() const { return refused_; }

 private:
  struct Entry {
    ProcessSpec spec;
    RestartPolicy policy;
    ProcessState state = ProcessState::kWaiting;
    std::optional<ChildProcess> child;
    std::optional<Clock::time_point> start_due;
    Clock::time_point started;
    Clock::time_point listened_since;  ///< Its start, later by the supervisor's pauses since.
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
  std::optional<Clock::time_point> stepped_;  ///< The last time.
  std::optional<Clock::time_point>
      stop_time_;                ///< When processes were asked to end, the last time.
  bool last_are_asked_ = false;  ///< Those that end last, too.
  bool killed_ = false;          ///< Of those that were asked, who was late.
  std::vector<std::string> refused_;
};

}  // namespace understory::launch
