// LCM event logs, the format of lcm-logger and lcm-logplayer.
//
// An event is: magic 0xEDA1DA01, event number (int64), receive time (int64, microseconds), channel
// length (int32), data length (int32), channel, data; integers big-endian. The format has no
// checksum and no index: the reader detects damage by impossible events and by the start of the
// next one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace understory::io {

/// One message as the logger received it.
struct LogEvent {
  std::int64_t number = 0;  ///< Counts from 0 in an undamaged log.
  std::int64_t utime = 0;   ///< Reception time of the logger [us since the epoch].
  std::string channel;      ///< 1..63 bytes.
  std::vector<std::uint8_t> data;
};

/// A file cannot be opened, read or written; what() states the file and the cause.
class LogError : public std::runtime_error {
 public:
  /// Takes the one-line message for what().
  using std::runtime_error::runtime_error;
};

/// Damage skipped by the reader so far.
struct LogDamage {
  std::uint64_t places = 0;       ///< Number of contiguous parts that are no event.
  std::uint64_t bytes = 0;        ///< Total bytes of these parts.
  std::uint64_t events_lost = 0;  ///< From the event numbers before and after each place; 0 where
                                  ///< they give no count (end of the file, decreasing numbers).
  std::uint64_t last_offset = 0;  ///< Offset of the latest place [bytes].
  std::uint64_t last_bytes = 0;   ///< Its length.
};

/// Reads a log from begin to end; after damage continues with the next plausible event.
///
/// Memory is bounded by the largest real event (lengths are checked against the file's size before
/// any allocation); time is linear in the file's size for any content.
class LcmLogReader {
 public:
  /// Throws LogError when the file cannot be opened or is not a regular file.
  explicit LcmLogReader(const std::filesystem::path& path);
  ~LcmLogReader();
  /// The moved-from object permits assignment and destruction only.
  LcmLogReader(LcmLogReader&&) noexcept;
  LcmLogReader& operator=(LcmLogReader&&) noexcept;

  /// The next event, or none at the end. Throws LogError when the device fails.
  std::optional<LogEvent> next();
  /// Damage skipped so far.
  const LogDamage& damage() const;
  /// Throws LogError with the file name if next() has reached the end of a file that is no log: it
  /// has bytes, but no complete event and no start of an event at its begin. An empty file is a
  /// valid log without messages; a file cut within its first event is a damaged log.
  void refuse_other_files() const;
  std::uint64_t position_bytes() const;  ///< Offset after the event returned last.
  std::uint64_t size_bytes() const;      ///< Size of the file at opening.

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// How a log is created. A device or a pipe is written directly.
enum class LogCreation : std::uint8_t {
  kWhole,           ///< Gets its name only when complete; otherwise no file is left.
  kGrowing,         ///< Has its name from the start; written data stays. The file must be new.
  kGrowingReplace,  ///< The same; a file of this name is overwritten.
};

/// Writes a log, by default completely or not at all: into a temporary file beside `path`, which
/// commit() renames. A recording grows instead, because its end is not known.
class LcmLogWriter {
 public:
  /// Opens the file. Throws LogError when it cannot be created.
  explicit LcmLogWriter(const std::filesystem::path& path,
                        LogCreation creation = LogCreation::kWhole);
  ~LcmLogWriter();
  /// The moved-from object permits assignment and destruction only.
  LcmLogWriter(LcmLogWriter&&) noexcept;
  LcmLogWriter& operator=(LcmLogWriter&&) noexcept;

  /// Throws LogError with the file where it cannot be written (e.g. a full disk), or with the
  /// channel where its name is empty or longer than 63 bytes.
  void write(const LogEvent& event);
  /// The same, numbered in order of writing.
  void write(std::int64_t utime, std::string_view channel, std::span<const std::uint8_t> data);
  /// Passes written data to the system, so that it survives the death of this process. Throws
  /// LogError.
  void flush();
  /// Flushes to the device and gives the file its name; no write() may follow. Throws LogError.
  void commit();
  /// Number of events written.
  std::uint64_t events() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::io
