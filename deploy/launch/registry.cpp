#include "deploy/launch/registry.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace understory::launch {

Registry::Registry(const std::filesystem::path& state_directory)
    : note_(state_directory / "launch.pids") {
  std::error_code error;
  std::filesystem::create_directories(state_directory, error);
  const auto lock_file = state_directory / "launch.lock";
  lock_ = ::open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock_ < 0) {
    throw std::runtime_error(fmt::format("{}: {}", lock_file.string(), std::strerror(errno)));
  }
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock_);
    throw std::runtime_error(
        fmt::format("{}: another launch is running with this state", state_directory.string()));
  }
}

Registry::~Registry() { ::close(lock_); }

std::vector<ProcessStatus> Registry::read() const {
  std::vector<ProcessStatus> processes;
  std::ifstream file(note_);
  ProcessStatus process;
  while (file >> process.name >> process.pid >> process.start_ticks >> process.restarts)
    processes.push_back(process);
  return processes;
}

void Registry::write(const std::vector<ProcessStatus>& processes) const {
  const std::filesystem::path temporary = note_.string() + ".part";
  {
    std::ofstream file(temporary);
    for (const auto& process : processes) {
      if (process.pid <= 0) continue;
      file << process.name << ' ' << process.pid << ' ' << process.start_ticks << ' '
           << process.restarts << '\n';
    }
    if (!file) return;
  }
  std::error_code ignored;
  std::filesystem::rename(temporary, note_, ignored);
}

}  // namespace understory::launch
