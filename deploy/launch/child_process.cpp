#include "deploy/launch/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

namespace understory::launch {
namespace {

// Debian 12's C library has no wrapper for these.
int open_pidfd(pid_t pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }
constexpr auto kByPidfd = static_cast<idtype_t>(3);  // P_PIDFD of linux/wait.h.

struct ProcStat {
  char state = '?';
  std::uint64_t start_ticks = 0;
};

/// proc(5): fields 3 and 22 of /proc/PID/stat; the name in field 2 may contain spaces and brackets.
std::optional<ProcStat> read_stat(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string line;
  if (!std::getline(file, line)) return std::nullopt;
  const auto behind_name = line.rfind(')');
  if (behind_name == std::string::npos) return std::nullopt;
  std::istringstream fields(line.substr(behind_name + 1));
  ProcStat stat;
  std::string skipped;
  fields >> stat.state;
  for (int field = 4; field < 22; ++field) fields >> skipped;
  if (!(fields >> stat.start_ticks)) return std::nullopt;
  return stat;
}

/// Runs in the child between fork and exec: system calls only.
[[noreturn]] void execute(char* const* arguments, char* const* environment, int error_pipe) {
  ::setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  ::execvpe(arguments[0], arguments, environment);
  const int cause = errno;
  [[maybe_unused]] const ssize_t put = ::write(error_pipe, &cause, sizeof cause);
  ::_exit(127);
}

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> result;
  result.reserve(strings.size() + 1);
  for (auto& string : strings) result.push_back(string.data());
  result.push_back(nullptr);
  return result;
}

/// The caller's environment with `changes` applied.
std::vector<std::string> merged_environment(const std::vector<std::string>& changes) {
  std::vector<std::string> merged = changes;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string variable = *entry;
    const std::string prefix = variable.substr(0, variable.find('=') + 1);
    bool replaced = false;
    for (const auto& change : changes) replaced = replaced || change.rfind(prefix, 0) == 0;
    if (!replaced) merged.push_back(variable);
  }
  return merged;
}

}  // namespace

std::string Ending::text() const {
  if (!known) return "ended (adopted: how is not known)";
  if (signal != 0) return fmt::format("killed by signal {} ({})", signal, ::strsignal(signal));
  return fmt::format("exited with status {}", exit_code);
}

ChildProcess ChildProcess::start(const Command& command) {
  std::vector<std::string> arguments{command.executable};
  arguments.insert(arguments.end(), command.arguments.begin(), command.arguments.end());
  auto environment = merged_environment(command.environment);
  const auto argv = pointers(arguments);
  const auto envp = pointers(environment);

  int error_pipe[2] = {-1, -1};
  if (::pipe2(error_pipe, O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe");
  }
  const pid_t pid = ::fork();
  if (pid == 0) execute(argv.data(), envp.data(), error_pipe[1]);
  const int fork_error = errno;
  ::close(error_pipe[1]);
  int cause = pid < 0 ? fork_error : 0;
  // The pipe closes by itself when exec succeeds.
  if (pid > 0 && ::read(error_pipe[0], &cause, sizeof cause) == sizeof cause) {
    ::waitpid(pid, nullptr, 0);
  }
  ::close(error_pipe[0]);
  if (cause != 0) throw std::system_error(cause, std::generic_category(), command.executable);

  const int pidfd = open_pidfd(pid);
  if (pidfd < 0) throw std::system_error(errno, std::generic_category(), "pidfd_open");
  const auto stat = read_stat(pid);
  return {pid, pidfd, stat ? stat->start_ticks : 0};
}

std::optional<ChildProcess> ChildProcess::adopt(pid_t pid, std::uint64_t start_ticks) {
  if (pid <= 0) return std::nullopt;
  const int pidfd = open_pidfd(pid);
  if (pidfd < 0) return std::nullopt;
  ChildProcess process(pid, pidfd, start_ticks);
  // Read after the handle is open, so the number cannot be reused any more.
  const auto stat = read_stat(pid);
  if (!stat || stat->start_ticks != start_ticks || stat->state == 'Z') return std::nullopt;
  return process;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(other.pid_), pidfd_(std::exchange(other.pidfd_, -1)), start_ticks_(other.start_ticks_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(pidfd_, other.pidfd_);
  std::swap(start_ticks_, other.start_ticks_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (pidfd_ >= 0) ::close(pidfd_);
}

void ChildProcess::signal(int number) const {
  ::syscall(SYS_pidfd_send_signal, pidfd_, number, nullptr, 0);
}

std::optional<Ending> ChildProcess::ended() const {
  siginfo_t info{};
  if (::waitid(kByPidfd, static_cast<id_t>(pidfd_), &info, WEXITED | WNOHANG) == 0) {
    if (info.si_pid == 0) return std::nullopt;
    Ending ending;
    (info.si_code == CLD_EXITED ? ending.exit_code : ending.signal) = info.si_status;
    return ending;
  }
  // Not our child, so only the handle shows its end.
  pollfd handle{pidfd_, POLLIN, 0};
  if (::poll(&handle, 1, 0) <= 0) return std::nullopt;
  return Ending{.known = false};
}

bool ChildProcess::is_stopped() const {
  const auto stat = read_stat(pid_);
  return stat && stat->state == 'T';
}

}  // namespace understory::launch
