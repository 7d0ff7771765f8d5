// Opening, closing and creation of map files.
#pragma once

#include <filesystem>
#include <memory>

#include "common/map_file/connection.hpp"

namespace understory::map_file {

/// The log or journal that a killed writer left beside a file; empty where there is none.
std::filesystem::path left_beside(const std::filesystem::path& file);

/// Opens a map file for reading one constant state until the connection is closed. The log of a
/// killed writer is first brought in; where there is no room for that, other processes are locked
/// out instead. Throws MapFileError.
std::unique_ptr<Connection> open_to_read(const std::filesystem::path& file);

/// Opens a map file for this process alone: locked for others until the connection is closed, with
/// a write-ahead log that is on the device at the end of a transaction. An older schema is
/// upgraded; a file with foreign SQL that would run is not changed (schema_guard.hpp). Throws
/// MapFileError.
std::unique_ptr<Connection> open_to_write(const std::filesystem::path& file);

/// Brings the write-ahead log into a file that was opened for writing, which is then a single file
/// again. If this fails (e.g. a full disk), the log stays for the next process; returns false.
bool leave(const Connection& connection) noexcept;

/// A file being created: under a temporary name, deleted unless it is moved to its name.
class NewFile {
 public:
  /// Creates an empty file beside the target of `file`. Fault::kRefused where the name exists
  /// already, kUnreadable where creation fails.
  explicit NewFile(const std::filesystem::path& file);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// Its present path.
  const std::filesystem::path& path() const { return part_; }
  /// Moves it to its name. Fault::kRefused where the name was created meanwhile.
  void move_to_its_name();

 private:
  std::filesystem::path target_;
  std::filesystem::path part_;
};

}  // namespace understory::map_file
