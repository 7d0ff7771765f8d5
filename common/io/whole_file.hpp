// A file that is written piece by piece and exists completely or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace understory::io {

/// Writes into a temporary file beside `path`, which commit() renames; without commit() no file is
/// left. Links are followed; devices and pipes are written directly. It needs no memory beyond the
/// caller's data.
class WholeFile {
 public:
  /// Throws DataError with the file and the cause where it cannot be created.
  explicit WholeFile(const std::filesystem::path& path);
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  /// Appends; throws DataError (e.g. a full disk).
  void write(std::string_view bytes);
  /// Flushes to the device and gives the file its name; no write() may follow. Throws DataError.
  void commit();
  /// Written so far [bytes].
  std::uint64_t size() const { return size_; }

 private:
  [[noreturn]] void fail(int error) const;
  void open_temporary();

  std::filesystem::path path_;
  std::string temporary_;  ///< Empty if the file is written directly or already has its name.
  bool is_direct_ = false;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace understory::io
