#include "common/map_file/opening.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/io/data_error.hpp"
#include "common/io/output_file.hpp"
#include "common/map_file/schema.hpp"
#include "common/map_file/schema_guard.hpp"

namespace understory::map_file {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void cannot(Fault fault, const fs::path& file, const std::string& why) {
  throw MapFileError(fault, fmt::format("{}: {}", file.string(), why));
}

/// SQLite would accept an empty file as a database, and report a folder as a failure of the device.
/// The file is not opened here, because closing it would release this process's locks on it.
void require_database(const fs::path& file) {
  std::error_code ignored;
  const fs::file_status status = fs::status(file, ignored);
  if (!fs::exists(status)) cannot(Fault::kUnreadable, file, "there is no such file");
  if (!fs::is_regular_file(status)) cannot(Fault::kUnreadable, file, "is no regular file");
  if (fs::file_size(file, ignored) == 0) cannot(Fault::kForeign, file, "no map file: it is empty");
}

fs::path beside(const fs::path& file, const char* suffix) { return file.string() + suffix; }

/// Whether leave() completed; a writer that was killed or lacked room leaves a log, or a file in
/// the format with a log.
bool is_at_rest(const fs::path& file, const fs::path& target) {
  if (!left_beside(target).empty()) return false;
  try {
    return Connection(file, Access::kRead, file).text("PRAGMA journal_mode") != "wal";
  } catch (const MapFileError& error) {
    if (error.fault() != Fault::kUnreadable) throw;
    return false;
  }
}

bool can_be_written(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  return ::faccessat(AT_FDCWD, file.c_str(), W_OK, AT_EACCESS) == 0 &&
         ::faccessat(AT_FDCWD, folder.c_str(), W_OK, AT_EACCESS) == 0;
}

/// SQLite treats a truncated last page as one filled with zeros.
void require_whole(const Connection& connection) {
  const auto page = static_cast<std::uintmax_t>(connection.number("PRAGMA page_size"));
  if (fs::file_size(connection.file()) % page != 0) connection.damaged("it was cut");
}

void check_keys(const Connection& connection) { connection.execute("PRAGMA foreign_keys = ON"); }

/// Applies the user's mask, as for any other file.
void give_usual_rights(int descriptor) {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(descriptor, 0666U & ~mask);
}

/// Renames, but never over an existing file. Returns 0, or the errno.
int rename_to_new(const fs::path& from, const fs::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  // Some file systems do not support it.
  if (errno != EINVAL && errno != ENOSYS) return errno;
  if (fs::exists(to)) return EEXIST;
  return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

/// Flushes the folder, so that the name is on the device too.
void sync_folder_of(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

fs::path target_of(const fs::path& file) {
  try {
    return io::behind_links(file);
  } catch (const io::DataError& error) {
    throw MapFileError(Fault::kUnreadable, error.what());
  }
}

}  // namespace

namespace {

std::unique_ptr<Connection> open_at_rest(const fs::path& file) {
  auto connection = std::make_unique<Connection>(file, Access::kRead, file);
  check_keys(*connection);
  connection->execute("BEGIN");
  verify_schema(*connection);
  require_whole(*connection);
  return connection;
}

/// The error for a log that cannot be brought in: the file alone shows neither its content nor
/// damage.
[[noreturn]] void cannot_bring_in(const fs::path& file, const fs::path& left,
                                  const MapFileError& error) {
  const bool is_fixed = !can_be_written(left);
  const std::string why = is_fixed ? std::strerror(errno) : error.what();
  cannot(is_fixed ? Fault::kReadOnly : error.fault(), file,
         fmt::format("a writer that was killed left {} beside it, which must be brought in before "
                     "the map can be read or written, and cannot ({}): copy both files to a disk "
                     "with room",
                     left.filename().string(), why));
}

bool is_of_the_disk(const MapFileError& error) {
  return error.fault() == Fault::kUnreadable || error.fault() == Fault::kReadOnly ||
         error.fault() == Fault::kFull;
}

std::unique_ptr<Connection> begin_writing(const fs::path& file) {
  const bool is_alone = left_beside(target_of(file)).empty();
  auto connection = std::make_unique<Connection>(file, Access::kWrite, file);
  // Set before the first access, so that the log's index is in memory and locks stay.
  connection->execute("PRAGMA locking_mode = EXCLUSIVE");
  check_keys(*connection);
  // A foreign file is not changed.
  verify_schema(*connection);
  if (is_alone) require_whole(*connection);
  if (sqlite3_db_readonly(connection->handle(), "main") != 0)
    cannot(Fault::kReadOnly, connection->file(), "it cannot be written");
  require_own_sql(*connection);

  connection->execute("PRAGMA synchronous = FULL");
  if (connection->text("PRAGMA journal_mode = WAL") != "wal")
    cannot(Fault::kReadOnly, connection->file(), "no write-ahead log can be kept beside it");
  // Takes the lock that excludes all others.
  connection->execute("BEGIN EXCLUSIVE; COMMIT");
  upgrade_schema(*connection);
  return connection;
}

}  // namespace

std::unique_ptr<Connection> open_to_read(const fs::path& file) {
  require_database(file);
  const fs::path target = target_of(file);
  const fs::path left = left_beside(target);
  try {
    if (!is_at_rest(file, target) && can_be_written(target)) {
      auto writer = begin_writing(file);
      if (!leave(*writer)) return writer;
    }
    return open_at_rest(file);
  } catch (const MapFileError& error) {
    if (left.empty() || !is_of_the_disk(error)) throw;
    cannot_bring_in(file, left, error);
  }
}

std::unique_ptr<Connection> open_to_write(const fs::path& file) {
  require_database(file);
  const fs::path left = left_beside(target_of(file));
  try {
    return begin_writing(file);
  } catch (const MapFileError& error) {
    if (left.empty() || !is_of_the_disk(error)) throw;
    cannot_bring_in(file, left, error);
  }
}

fs::path left_beside(const fs::path& target) {
  std::error_code ignored;
  for (const char* const suffix : {"-wal", "-journal"}) {
    if (fs::exists(beside(target, suffix), ignored)) return beside(target, suffix);
  }
  return {};
}

bool leave(const Connection& connection) noexcept {
  return sqlite3_exec(connection.handle(), "PRAGMA journal_mode = DELETE", nullptr, nullptr,
                      nullptr) == SQLITE_OK;
}

NewFile::NewFile(const fs::path& file) : target_(target_of(file)) {
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(target_, ignored)))
    cannot(Fault::kRefused, file, "is there already");
  std::string part = target_.string() + ".part-XXXXXX";
  const int descriptor = ::mkostemp(part.data(), O_CLOEXEC);
  if (descriptor < 0)
    cannot(Fault::kUnreadable, file, fmt::format("cannot be made: {}", std::strerror(errno)));
  give_usual_rights(descriptor);
  ::close(descriptor);
  part_ = part;
}

NewFile::~NewFile() {
  if (part_.empty()) return;
  for (const char* const suffix : {"", "-journal", "-wal"}) ::unlink(beside(part_, suffix).c_str());
}

void NewFile::move_to_its_name() {
  if (const int error = rename_to_new(part_, target_); error != 0)
    cannot(error == EEXIST ? Fault::kRefused : Fault::kUnreadable, target_,
           fmt::format("cannot be made: {}", std::strerror(error)));
  part_.clear();
  sync_folder_of(target_);
}

}  // namespace understory::map_file
