// Random reads in a file through one buffer of fixed size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace understory::io {

/// The size is fixed at opening; reads of a file that shrinks are short.
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
  /// Fills `out` from `offset`; false when the file is shorter. The buffer stays unchanged, so that
  /// reading ahead costs only the bytes read.
  bool read(std::uint64_t offset, std::span<std::uint8_t> out);

  /// Offset of the next data at or after `offset`; holes use no room on the device. The size of the
  /// file where there is none; `offset` where the file system does not report holes.
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
