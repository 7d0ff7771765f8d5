// A disk that fails: a layer between SQLite and the system's files.
#pragma once

#include <sqlite3.h>

#include <cstring>
#include <memory>
#include <new>

namespace understory::test {

/// While one of these lives, all files of SQLite go through it. From the `first_failure`-th write,
/// sync or truncation on (from 1) each of them fails, until set_whole(); with SQLITE_IOERR_READ
/// reads count and fail as well. One at a time.
class FailingDisk {
 public:
  FailingDisk() {
    state() = {};
    system_ = sqlite3_vfs_find(nullptr);
    layer_ = *system_;
    layer_.zName = "failing-disk";
    layer_.szOsFile = static_cast<int>(sizeof(File)) + system_->szOsFile;
    layer_.pAppData = system_;
    layer_.xOpen = open;
    layer_.xDelete = remove;
    layer_.xAccess = access;
    layer_.xFullPathname = full_name;
    sqlite3_vfs_register(&layer_, 1);
  }
  ~FailingDisk() {
    sqlite3_vfs_register(system_, 1);
    sqlite3_vfs_unregister(&layer_);
  }
  FailingDisk(const FailingDisk&) = delete;
  FailingDisk& operator=(const FailingDisk&) = delete;

  void fail_from(long first_failure, int code) { state() = {0, first_failure, code, 0}; }
  void set_whole() { state() = {}; }
  /// Whether anything has failed since fail_from().
  bool has_failed() const { return state().failures > 0; }

 private:
  struct State {
    long calls = 0;
    long first_failure = 0;  // 0 = none
    int code = SQLITE_FULL;
    long failures = 0;
  };
  /// What SQLite sees as a file; the system's own is behind it in memory.
  struct File {
    sqlite3_file base;
    sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
  };

  static State& state() {
    static State instance;
    return instance;
  }
  static int failure() {
    State& now = state();
    if (now.first_failure == 0 || ++now.calls < now.first_failure) return SQLITE_OK;
    ++now.failures;
    return now.code;
  }
  static sqlite3_file* real(sqlite3_file* file) { return reinterpret_cast<File*>(file)->real(); }
  static sqlite3_vfs* system(sqlite3_vfs* layer) {
    return static_cast<sqlite3_vfs*>(layer->pAppData);
  }

  static int close(sqlite3_file* file) { return real(file)->pMethods->xClose(real(file)); }
  static int read(sqlite3_file* file, void* to, int size, sqlite3_int64 at) {
    if (state().code == SQLITE_IOERR_READ && failure() != SQLITE_OK) return SQLITE_IOERR_READ;
    return real(file)->pMethods->xRead(real(file), to, size, at);
  }
  static int write(sqlite3_file* file, const void* from, int size, sqlite3_int64 at) {
    const int failed = failure();
    if (failed != SQLITE_OK) return failed == SQLITE_IOERR_READ ? SQLITE_IOERR_WRITE : failed;
    return real(file)->pMethods->xWrite(real(file), from, size, at);
  }
  static int truncate(sqlite3_file* file, sqlite3_int64 size) {
    const int failed = failure();
    return failed != SQLITE_OK ? SQLITE_IOERR_TRUNCATE
                               : real(file)->pMethods->xTruncate(real(file), size);
  }
  static int sync(sqlite3_file* file, int flags) {
    const int failed = failure();
    return failed != SQLITE_OK ? SQLITE_IOERR_FSYNC
                               : real(file)->pMethods->xSync(real(file), flags);
  }
  static int size(sqlite3_file* file, sqlite3_int64* size) {
    return real(file)->pMethods->xFileSize(real(file), size);
  }
  static int lock(sqlite3_file* file, int level) {
    return real(file)->pMethods->xLock(real(file), level);
  }
  static int unlock(sqlite3_file* file, int level) {
    return real(file)->pMethods->xUnlock(real(file), level);
  }
  static int is_reserved(sqlite3_file* file, int* result) {
    return real(file)->pMethods->xCheckReservedLock(real(file), result);
  }
  static int control(sqlite3_file* file, int what, void* argument) {
    return real(file)->pMethods->xFileControl(real(file), what, argument);
  }
  static int sector(sqlite3_file* file) { return real(file)->pMethods->xSectorSize(real(file)); }
  static int traits(sqlite3_file* file) {
    return real(file)->pMethods->xDeviceCharacteristics(real(file));
  }

  static int open(sqlite3_vfs* layer, const char* name, sqlite3_file* file, int flags, int* out) {
    // Version 1: no shared memory, which a file that is locked for one process does not need.
    static const sqlite3_io_methods kMethods{
        1,       close,  read,   write,   truncate, sync,    size,    lock,    unlock, is_reserved,
        control, sector, traits, nullptr, nullptr,  nullptr, nullptr, nullptr, nullptr};
    auto* const wrapped = reinterpret_cast<File*>(file);
    wrapped->real()->pMethods = nullptr;
    const int result = system(layer)->xOpen(system(layer), name, wrapped->real(), flags, out);
    file->pMethods = wrapped->real()->pMethods != nullptr ? &kMethods : nullptr;
    return result;
  }
  static int remove(sqlite3_vfs* layer, const char* name, int sync_folder) {
    return system(layer)->xDelete(system(layer), name, sync_folder);
  }
  static int access(sqlite3_vfs* layer, const char* name, int flags, int* result) {
    return system(layer)->xAccess(system(layer), name, flags, result);
  }
  static int full_name(sqlite3_vfs* layer, const char* name, int size, char* out) {
    return system(layer)->xFullPathname(system(layer), name, size, out);
  }

  sqlite3_vfs* system_ = nullptr;
  sqlite3_vfs layer_{};
};

}  // namespace understory::test
