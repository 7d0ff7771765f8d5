#include "common/io/file_window.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/io/lcm_log.hpp"

namespace understory::io {

FileWindow::FileWindow(const std::filesystem::path& path) : path_(path), window_(kWindowBytes) {
  struct stat status {};
  // Checked before opening, because opening a pipe would wait for its writer.
  if (::stat(path.c_str(), &status) != 0) {
    throw LogError(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  }
  if (!S_ISREG(status.st_mode)) {
    throw LogError(fmt::format("{}: not a regular file", path.string()));
  }
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) throw LogError(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  size_ = static_cast<std::uint64_t>(status.st_size);
}

FileWindow::~FileWindow() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::size_t FileWindow::read_some(std::uint64_t offset, std::span<std::uint8_t> out) {
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t got = ::pread(descriptor_, out.data() + done, out.size() - done,
                                static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      throw LogError(fmt::format("{}: cannot read at byte {}: {}", path_.string(), offset + done,
                                 std::strerror(errno)));
    }
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }

  return done;
}

std::uint64_t FileWindow::data_from(std::uint64_t offset) const {
  if (offset >= size_) return size_;
  const off_t data = ::lseek(descriptor_, static_cast<off_t>(offset), SEEK_DATA);
  if (data < 0) return errno == ENXIO ? size_ : offset;
  return std::min(static_cast<std::uint64_t>(data), size_);
}

bool FileWindow::contains(std::uint64_t offset, std::size_t count) const {
  return offset >= window_offset_ && offset + count <= window_offset_ + window_bytes_;
}

std::span<const std::uint8_t> FileWindow::peek(std::uint64_t offset, std::size_t count) {
  if (offset >= size_) return {};
  count = static_cast<std::size_t>(
      std::min({std::uint64_t{count}, std::uint64_t{kWindowBytes}, size_ - offset}));
  if (!contains(offset, count)) {
    window_offset_ = offset;
    window_bytes_ = 0;
    window_bytes_ = read_some(offset, window_);
    count = std::min(count, window_bytes_);
  }
  return std::span<const std::uint8_t>(window_).subspan(offset - window_offset_, count);
}

bool FileWindow::read(std::uint64_t offset, std::span<std::uint8_t> out) {
  if (offset > size_ || out.size() > size_ - offset) return false;
  if (contains(offset, out.size())) {
    const auto first = window_.begin() + static_cast<std::ptrdiff_t>(offset - window_offset_);
    std::copy_n(first, out.size(), out.begin());
    return true;
  }
  return read_some(offset, out) == out.size();
}

}  // namespace understory::io
