// A recording of several files, in a folder or in a zip archive.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace understory::io {

/// Access to the files of a recording by name.
class RecordingFolder {
 public:
  /// A folder or a zip archive. Throws DataError when the path is neither.
  explicit RecordingFolder(std::filesystem::path path);

  /// The whole content of the file of this name (case and leading folders do not matter). Throws
  /// DataError when it is missing, damaged, or larger than `kMaxFileBytes`.
  std::string read(std::string_view name) const;
  /// The file's name for messages: "archive.zip:LASER.txt", "folder/LASER.txt".
  std::string describe(std::string_view name) const;

  /// Limit for one unpacked file [bytes]: a damaged archive may state any size.
  static constexpr std::uint64_t kMaxFileBytes = 1ULL << 30U;

 private:
  std::filesystem::path path_;
  bool is_archive_ = false;
};

}  // namespace understory::io
