#include "common/map_file/map_look.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "common/map_file/drive_file.hpp"
#include "common/map_file/opening.hpp"

namespace understory::map_file {
namespace {

namespace fs = std::filesystem;

/// The bytes by which SQLite locks a file (sqlite.org/fileformat2.html, "lock-byte page").
constexpr off_t kFirstLockByte = 0x40000000;
constexpr off_t kLockBytes = 512;

/// Whether any process has a lock on it; every process that has it open has one.
bool is_locked(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = kFirstLockByte;
  lock.l_len = kLockBytes;
  const bool is_held = ::fcntl(descriptor, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  ::close(descriptor);
  return is_held;
}

/// Whether the format's version makes SQLite create a log when reading.
bool asks_for_log(const fs::path& file) {
  constexpr std::streamoff kWriteVersion = 18;
  constexpr char kLogVersion = 2;
  std::array<char, 2> versions{};
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(kWriteVersion);
  stream.read(versions.data(), versions.size());
  return versions[0] == kLogVersion || versions[1] == kLogVersion;
}

bool is_drive_under_way(const fs::path& file) {
  const Connection connection(file, Access::kRead, file);
  return connection.number("SELECT count(*) FROM sqlite_schema WHERE name = 'understory_meta'") >
             0 &&
         is_open_drive(connection);
}

/// The reason why the file must be recovered before reading; empty = not needed.
std::string remark_on(const fs::path& file) {
  const fs::path left = left_beside(file);
  if (!left.empty())
    return fmt::format("{} lies beside it: a writer was killed", left.filename().string());
  if (asks_for_log(file)) return "its last writer did not end";
  return is_drive_under_way(file) ? "the store of its drive did not end" : "";
}

fs::path temporary_folder() {
  std::string name = (fs::temp_directory_path() / "understory-look-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw MapFileError(Fault::kUnreadable,
                       fmt::format("{}: cannot be made: {}", name, std::strerror(errno)));
  return name;
}

/// Replaces the copy's name in the error by the name that the user gave.
[[noreturn]] void rethrow_as(const MapFileError& error, const fs::path& copy,
                             const fs::path& file) {
  std::string line = error.what();
  const std::string from = copy.string();
  for (std::size_t at = 0; (at = line.find(from, at)) != std::string::npos;)
    line.replace(at, from.size(), file.string());
  throw MapFileError(error.fault(), line);
}

}  // namespace

MapLook::MapLook(const fs::path& file) {
  std::error_code ignored;
  const fs::path target = fs::weakly_canonical(file, ignored);
  const bool is_file = fs::is_regular_file(target, ignored) && fs::file_size(target, ignored) > 0;
  if (is_file) remark_ = remark_on(target);
  if (remark_.empty()) {
    opened_ = std::make_unique<MapFile>(file, Access::kRead);
    return;
  }
  if (is_locked(target))
    throw MapFileError(Fault::kInUse,
                       fmt::format("{}: another process has it open", file.string()));

  folder_ = temporary_folder();
  const fs::path copy = folder_ / target.filename();
  try {
    for (const char* const suffix : {"", "-wal", "-journal"}) {
      const fs::path part = target.string() + suffix;
      if (!fs::exists(part)) continue;
      fs::copy_file(part, copy.string() + suffix);
      fs::permissions(copy.string() + suffix, fs::perms::owner_read | fs::perms::owner_write);
    }
    opened_ = std::make_unique<MapFile>(copy, Access::kRead);
  } catch (const MapFileError& error) {
    fs::remove_all(folder_, ignored);
    rethrow_as(error, copy, file);
  } catch (...) {
    fs::remove_all(folder_, ignored);
    throw;
  }
  remark_ += "; shown as if that were brought in, and left as it is";
}

MapLook::~MapLook() {
  opened_.reset();
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

}  // namespace understory::map_file
