#include "tests/bus/failing_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>

namespace {

struct Device {
  long first_failure = 0;  // 0 = none
  long calls = 0;
  long failures = 0;
};

Device& device() {
  static Device instance;
  return instance;
}

bool fails() {
  Device& now = device();
  if (now.first_failure == 0 || ++now.calls < now.first_failure) return false;
  ++now.failures;
  errno = EIO;
  return true;
}

bool is_file(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

}  // namespace

// What state_store.cpp calls: the program's own functions come before those of the C library.
extern "C" {

ssize_t write(int file, const void* bytes, size_t size) {
  const bool is_armed = device().first_failure != 0 && is_file(file);
  if (is_armed && fails()) {
    if (device().failures == 1 && size > 1) return ::syscall(SYS_write, file, bytes, size / 2);
    return -1;
  }
  return ::syscall(SYS_write, file, bytes, size);
}
int fdatasync(int file) { return fails() ? -1 : static_cast<int>(::syscall(SYS_fdatasync, file)); }
int ftruncate(int file, off_t size) {
  return fails() ? -1 : static_cast<int>(::syscall(SYS_ftruncate, file, size));
}
int rename(const char* from, const char* to) noexcept {
  return fails() ? -1 : static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}

}  // extern "C"

namespace understory::test {

void FailingFiles::fail_from(long first_failure) { device() = {first_failure, 0, 0}; }
void FailingFiles::set_whole() { device() = {}; }
long FailingFiles::failures() const { return device().failures; }

}  // namespace understory::test
