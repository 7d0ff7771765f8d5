// A process with its handle (pidfd): its death is an event on a descriptor, and a signal can never
// reach another process with the same number.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace understory::launch {

/// A program to start.
struct Command {
  std::string executable;  ///< A path, or a name to find in PATH.
  std::vector<std::string> arguments;
  std::vector<std::string> environment;  ///< "NAME=value", added to the caller's environment.
};

/// How a process ended.
struct Ending {
  bool known = true;  ///< False for an adopted process, because only a parent gets the status.
  int exit_code = 0;  ///< Valid if it exited.
  int signal = 0;     ///< Valid if a signal ended it.

  /// "exited with status 1", "killed by signal 9 (Killed)" and the like.
  std::string text() const;
};

/// A running or ended process.
class ChildProcess {
 public:
  /// Starts a process in a group of its own (Ctrl-C at the terminal reaches the supervisor alone).
  /// Throws std::system_error where it cannot be executed.
  static ChildProcess start(const Command& command);
  /// Takes over a running process that another supervisor started; none where it no longer runs (or
  /// another process has its number).
  static std::optional<ChildProcess> adopt(pid_t pid, std::uint64_t start_ticks);

  /// Moves the handle.
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();  ///< Closes the handle; the process continues.

  /// The process's number.
  pid_t pid() const { return pid_; }
  int descriptor() const { return pidfd_; }  ///< Readable once the process has ended.
  /// Start time in the kernel's ticks since boot; with the pid it is the process's identity.
  std::uint64_t start_ticks() const { return start_ticks_; }

  /// Sends a signal; no effect on an ended process.
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
