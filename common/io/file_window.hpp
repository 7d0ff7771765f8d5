// Random reads in a file through one buffer of fixed size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace understory::io {

/// The file keeps the size it had when it was opened; one that shrinks meanwhile reads short.
class FileWindow {
 public:
  /// Throws LogError when the file cannot be opened or is not a regular file.
  explicit FileWindow(const std::filesystem::path& path);
  ~FileWindow();
  FileWindow(const FileWindow&) = delete;
  FileWindow& operator=(const FileWindow&) = delete;

  /// Size of the file when it was opened [bytes].
  std::uint64_t size() const { return size_; }
  /// Up to `count` bytes (at most kWindowBytes) from `offset`; fewer at the end of the file. Valid
  /// until the next call.
  std::span<const std::uint8_t> peek(std::uint64_t offset, std::size_t count);
  /// Fills `out` from `offset`; false when the file ends before. Leaves the buffer where it is, so
  /// that looking ahead costs no more than what it reads.
  bool read(std::uint64_t offset, std::span<std::uint8_t> out);

  /// Where the file's next data is, at or behind `offset`: a hole in between takes no room on the
  /// device. The size of the file when there is none; `offset` where the file system does not tell.
  std::uint64_t data_from(std::uint64_t offset) const;

  static constexpr std::size_t kWindowBytes = 256 * 1024;

 private:
  bool contains(std::uint64_t offset, std::size_t count) const;
  std::size_t read_some(std::uint64_t offset, std::span<std::uint8_t> out);

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  std::vector<std::uint8_t> window_;
  std::uint64_t window_offset_ = 0;
  std::size_t window_bytes_ = 0;
};

}  // namespace understory::io
