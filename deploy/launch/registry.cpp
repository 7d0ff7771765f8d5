#include "deploy/launch/registry.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <system_error>

namespace understory::launch {
namespace {

namespace fs = std::filesystem;

/// Directory for launches of this user with this state directory; other users cannot create files
/// in it.
fs::path spare_directory(const fs::path& state_directory) {
  std::error_code error;
  const fs::path temporary = fs::temp_directory_path(error);
  const std::size_t hash = std::hash<std::string>{}(fs::absolute(state_directory, error).string());
  return temporary / fmt::format("understory-{}-{:016x}", ::geteuid(), hash);
}

/// False: it does not exist, or belongs to another user.
bool is_own(const fs::path& directory) {
  struct stat found {};
  return ::lstat(directory.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
         found.st_uid == ::geteuid();
}

/// Creates it if missing. False: creation failed, or it belongs to another user.
bool make_own(const fs::path& directory) {
  ::mkdir(directory.c_str(), 0700);
  return is_own(directory);
}

/// On a disk that has become read-only, an existing file can still be locked. -1 = no file;
/// `error`: reason why the file cannot be written.
int open_lock(const fs::path& file, std::error_code& error) {
  const int lock = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock >= 0) return lock;
  error = {errno, std::generic_category()};
  return ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
}

bool write_note(const fs::path& note, const std::vector<ProcessStatus>& processes) {
  const fs::path temporary = note.string() + ".part";
  std::error_code error;
  {
    std::ofstream file(temporary);
    for (const auto& process : processes) {
      if (process.pid <= 0) continue;
      file << process.name << ' ' << process.pid << ' ' << process.start_ticks << ' '
           << process.restarts << '\n';
    }

    file.close();
    if (!file) {
      fs::remove(temporary, error);
      return false;
    }
  }

  fs::rename(temporary, note, error);
  return !error;
}

}  // namespace

Registry::Registry(const fs::path& state_directory)
    : note_(state_directory / "launch.pids"),
      spare_note_(spare_directory(state_directory) / "launch.pids") {
  std::error_code not_made;
  std::error_code not_written;
  fs::create_directories(state_directory, not_made);
  lock_ = open_lock(state_directory / "launch.lock", not_written);
  if (not_made || not_written) {
    trouble_ = fmt::format("{}: {}", state_directory.string(),
                           (not_made ? not_made : not_written).message());
  }

  const fs::path spare = spare_note_.parent_path();
  if (lock_ < 0 && make_own(spare)) lock_ = open_lock(spare / "launch.lock", not_written);
  if (lock_ < 0 || ::flock(lock_, LOCK_EX | LOCK_NB) == 0) return;
  ::close(lock_);
  throw std::runtime_error(
      fmt::format("{}: another launch is running with this state", state_directory.string()));
}

Registry::~Registry() {
  if (lock_ >= 0) ::close(lock_);
}

std::vector<ProcessStatus> Registry::read() const {
  std::vector<ProcessStatus> processes;
  std::error_code error;
  const bool is_spare = is_own(spare_note_.parent_path()) && fs::exists(spare_note_, error);
  std::ifstream file(is_spare ? spare_note_ : note_);
  ProcessStatus process;
  while (file >> process.name >> process.pid >> process.start_ticks >> process.restarts)
    processes.push_back(process);
  return processes;
}

void Registry::write(const std::vector<ProcessStatus>& processes) const {
  std::error_code ignored;
  if (write_note(note_, processes)) {
    fs::remove(spare_note_, ignored);
  } else if (make_own(spare_note_.parent_path())) {
    write_note(spare_note_, processes);
  }
}

}  // namespace understory::launch
