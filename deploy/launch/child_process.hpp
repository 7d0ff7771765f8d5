// A process held by its handle (pidfd): its death is an event on a descriptor, and a signal can
// never hit another process that got the same number.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace understory::launch {

struct Command {
  std::string executable;  ///< A path, or a name that is looked for in PATH.
  std::vector<std::string> arguments;
  std::vector<std::string> environment;  ///< "NAME=value", on top of the caller's.
};

/// How a process ended.
struct Ending {
  bool known = true;  ///< False for an adopted process: only its parent is told.
  int exit_code = 0;  ///< Where it exited.
  int signal = 0;     ///< Where a signal ended it.

  std::string text() const;
};

class ChildProcess {
 public:
  /// Starts a process in a group of its own (Ctrl-C at the terminal reaches the supervisor alone).
  /// Throws std::system_error when it cannot be executed.
  static ChildProcess start(const Command& command);
  /// Takes over a running process that another supervisor started; none when it no longer runs.
  static std::optional<ChildProcess> adopt(pid_t pid, std::uint64_t start_ticks);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();  ///< Lets go of the handle; the process lives on.

  pid_t pid() const { return pid_; }
  int descriptor() const { return pidfd_; }  ///< Readable once the process has ended.
  /// When it started, in the kernel's ticks since boot: with the pid, its identity.
  std::uint64_t start_ticks() const { return start_ticks_; }

  void signal(int number) const;
  /// How it ended; none while it runs.
  std::optional<Ending> ended() const;
  /// Whether it was stopped (SIGSTOP, not a debugger).
  bool is_stopped() const;

 private:
  ChildProcess(pid_t pid, int pidfd, std::uint64_t start_ticks)
      : pid_(pid), pidfd_(pidfd), start_ticks_(start_ticks) {}

  pid_t pid_ = -1;
  int pidfd_ = -1;
  std::uint64_t start_ticks_ = 0;
};

}  // namespace understory::launch
