// Files that fail as on a dying device: write, flush, truncation and renaming give EIO.
#pragma once

namespace understory::test {

/// While one of these lives, the `first_failure`-th call (from 1) that changes a file of a state
/// and all after it fail with EIO, until set_whole(); a write that fails has written half. One at
/// a time. The functions of the C library are replaced in this program (`failing_files.cpp`).
class FailingFiles {
 public:
  FailingFiles() = default;
  ~FailingFiles() { set_whole(); }
  FailingFiles(const FailingFiles&) = delete;
  FailingFiles& operator=(const FailingFiles&) = delete;

  void fail_from(long first_failure);
  void set_whole();
  /// Calls that have failed since fail_from().
  long failures() const;
};

}  // namespace understory::test
