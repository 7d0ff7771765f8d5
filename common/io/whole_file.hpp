// A file that is written piece by piece, and is there whole or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace understory::io {

/// Writes into a temporary file beside `path`, which takes its name in commit(); without commit()
/// nothing is left behind. Links are followed; devices and pipes are written directly. Memory: none
/// but what the caller hands over.
class WholeFile {
 public:
  /// Throws DataError naming the file and the cause when it cannot be created.
  explicit WholeFile(const std::filesystem::path& path);
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  /// Appends; throws DataError (a full disk, say).
  void write(std::string_view bytes);
  /// Flushes to the device and gives the file its name; no write() may follow. Throws DataError.
  void commit();
  /// Written so far [bytes].
  std::uint64_t size() const { return size_; }

 private:
  [[noreturn]] void fail(int error) const;
  void open_temporary();

  std::filesystem::path path_;
  std::string temporary_;  ///< Empty: the file is written directly, or has its name.
  bool is_direct_ = false;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace understory::io
