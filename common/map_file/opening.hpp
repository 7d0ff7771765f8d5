// How map files are opened, left, and come into being.
#pragma once

#include <filesystem>
#include <memory>

#include "common/map_file/connection.hpp"

namespace understory::map_file {

/// The log or journal that a killed writer left beside a file; empty where there is none.
std::filesystem::path left_beside(const std::filesystem::path& file);

/// Opens a map file for reading: one state of it, held until the connection goes. What a killed
/// writer left beside it is brought in first; where there is no room for that, others are locked
/// out instead. Throws MapFileError.
std::unique_ptr<Connection> open_to_read(const std::filesystem::path& file);

/// Opens a map file for this process alone: locked against all others until the connection goes,
/// with a write-ahead log that is on the device when a transaction ends. A file of an older schema
/// becomes one of the current one; one with SQL of others that would act is not touched
/// (schema_guard.hpp). Throws MapFileError.
std::unique_ptr<Connection> open_to_write(const std::filesystem::path& file);

/// Brings the write-ahead log into a file that was opened to write, which is then a single file
/// again. Where that fails (a full disk), the log stays beside it for the next one to bring in;
/// false.
bool leave(const Connection& connection) noexcept;

/// A file under way: beside its name, and gone unless it is moved there.
class NewFile {
 public:
  /// Makes an empty file beside `file`, behind its links. Fault::kRefused where something is there
  /// already, kUnreadable where none can be made.
  explicit NewFile(const std::filesystem::path& file);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// Where it is now.
  const std::filesystem::path& path() const { return part_; }
  /// Gives it its name, for good. Fault::kRefused where something came to be there meanwhile.
  void move_to_its_name();

 private:
  std::filesystem::path target_;
  std::filesystem::path part_;
};

}  // namespace understory::map_file
