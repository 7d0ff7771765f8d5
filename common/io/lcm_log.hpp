// LCM event logs, as lcm-logger writes them and lcm-logplayer reads them.
//
// An event is: magic 0xEDA1DA01, event number (int64), receive time (int64, microseconds), channel
// length (int32), data length (int32), channel, data; integers big-endian. The format has no
// checksum and no index: the reader finds damage by what cannot be an event and by where the next
// one starts.
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
  std::int64_t number = 0;  ///< Counts from 0 in a log that is whole.
  std::int64_t utime = 0;   ///< When the logger received it [us since the epoch].
  std::string channel;      ///< 1..63 bytes.
  std::vector<std::uint8_t> data;
};

/// A file that cannot be opened, read or written; what() names the file and the cause.
class LogError : public std::runtime_error {
 public:
  /// From the one-line message that what() gives.
  using std::runtime_error::runtime_error;
};

/// What the reader had to skip so far.
struct LogDamage {
  std::uint64_t places = 0;       ///< Contiguous stretches that are no event.
  std::uint64_t bytes = 0;        ///< In all of them together.
  std::uint64_t events_lost = 0;  ///< By the event numbers before and after each place; 0 where
                                  ///< they do not show it (end of the file, numbers that go back).
  std::uint64_t last_offset = 0;  ///< Where the latest place starts [bytes].
  std::uint64_t last_bytes = 0;   ///< How long it is.
};

/// Reads a log from front to back; after damage goes on with the next plausible event.
///
/// Memory is bounded by the largest event that really is in the file (lengths are checked against
/// the size of the file before anything is allocated); time is linear in the file's size whatever
/// the file holds.
class LcmLogReader {
 public:
  /// Throws LogError when the file cannot be opened or is no regular file.
  explicit LcmLogReader(const std::filesystem::path& path);
  ~LcmLogReader();
  /// Leaves the other one fit for assignment and destruction only.
  LcmLogReader(LcmLogReader&&) noexcept;
  LcmLogReader& operator=(LcmLogReader&&) noexcept;

  /// The next event, or none at the end. Throws LogError when the device fails.
  std::optional<LogEvent> next();
  /// What was skipped so far.
  const LogDamage& damage() const;
  /// Throws LogError naming the file where next() has come to the end of one that has bytes, but
  /// neither a whole event nor the beginning of one in front: another kind of file. An empty file
  /// is the log of a recorder that heard nothing; one that was cut within its first event is
  /// damaged.
  void refuse_other_files() const;
  std::uint64_t position_bytes() const;  ///< Behind the event given last.
  std::uint64_t size_bytes() const;      ///< Of the file when it was opened.

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// How a log comes into being. Where the path is a device or a pipe it is written directly.
enum class LogCreation : std::uint8_t {
  kWhole,           ///< Under its name only when it is complete; else nothing is left behind.
  kGrowing,         ///< Under its name from the start; what was written stays. Must be new.
  kGrowingReplace,  ///< The same; a file of this name is overwritten.
};

/// Writes a log, by default whole or not at all: into a temporary file beside `path`, which takes
/// its name in commit(). A recording grows instead: its end cannot be foreseen.
class LcmLogWriter {
 public:
  /// Opens the file. Throws LogError when it cannot be created.
  explicit LcmLogWriter(const std::filesystem::path& path,
                        LogCreation creation = LogCreation::kWhole);
  ~LcmLogWriter();
  /// Leaves the other one fit for assignment and destruction only.
  LcmLogWriter(LcmLogWriter&&) noexcept;
  LcmLogWriter& operator=(LcmLogWriter&&) noexcept;

  /// Throws LogError naming the file when it cannot be written (a full disk, say), or naming the
  /// channel when it is empty or longer than 63 bytes.
  void write(const LogEvent& event);
  /// The same, numbered in order of writing.
  void write(std::int64_t utime, std::string_view channel, std::span<const std::uint8_t> data);
  /// Hands what was written to the system, so that the death of this process cannot lose it. Throws
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
