#include "common/io/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "common/io/data_error.hpp"

namespace understory::io {
namespace {

namespace fs = std::filesystem;

/// The kernel follows the same number.
constexpr int kMostLinks = 40;

[[noreturn]] void cannot_write(const fs::path& file, int error) {
  throw DataError(fmt::format("{}: cannot be written: {}", file.string(), std::strerror(error)));
}

/// Returns 0, or the errno of a failure.
int put_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t put = ::write(descriptor, text.data(), text.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(put));
  }
  return 0;
}

/// The standard stream directed to this file; -1 = none.
int standard_stream_of(const struct stat& file) {
  for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO}) {
    struct stat stream {};
    if (::fstat(descriptor, &stream) != 0) continue;
    if (stream.st_dev == file.st_dev && stream.st_ino == file.st_ino) return descriptor;
  }
  return -1;
}

/// Earlier output stays before it.
void write_to_stream(int descriptor, const fs::path& file, std::string_view text) {
  std::fflush(descriptor == STDOUT_FILENO ? stdout : stderr);
  if (const int error = put_all(descriptor, text); error != 0) cannot_write(file, error);
}

void write_directly(const fs::path& file, std::string_view text) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) cannot_write(file, errno);
  const int error = put_all(descriptor, text);
  ::close(descriptor);
  if (error != 0) cannot_write(file, error);
}

/// mkostemp makes a file private; the user's mask must apply, as for any other file.
void give_usual_mode(int descriptor) {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(descriptor, 0666U & ~mask);
}

void replace(const fs::path& file, std::string_view text) {
  std::string part = file.string() + ".part-XXXXXX";
  const int descriptor = ::mkostemp(part.data(), O_CLOEXEC);
  if (descriptor < 0) cannot_write(file, errno);
  give_usual_mode(descriptor);

  int error = put_all(descriptor, text);
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(part.c_str(), file.c_str()) != 0) error = errno;
  if (error == 0) return;
  ::unlink(part.c_str());
  cannot_write(file, error);
}

}  // namespace

fs::path behind_links(const fs::path& file) {
  fs::path target = file;
  std::error_code ignored;
  for (int i = 0; fs::is_symlink(target, ignored); ++i) {
    if (i == kMostLinks) cannot_write(file, ELOOP);
    const fs::path next = fs::read_symlink(target, ignored);
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target;
}

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a, b, error) && !error;
}

bool is_special(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

void write_whole_file(const fs::path& file, std::string_view text) {
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0) {
    const int stream = standard_stream_of(status);
    if (stream >= 0 && !S_ISCHR(status.st_mode)) return write_to_stream(stream, file, text);
    if (!S_ISREG(status.st_mode)) return write_directly(file, text);
  }
  replace(behind_links(file), text);
}

}  // namespace understory::io
