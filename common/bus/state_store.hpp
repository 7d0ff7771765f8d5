// A service's state on disk: a snapshot and the later input events. Together they survive SIGKILL
// at any moment.
#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/wire/result.hpp"

namespace understory::bus {

/// One received input message.
struct JournalEvent {
  std::string channel;
  std::vector<std::uint8_t> bytes;
};

/// Files NAME.snapshot and NAME.journal.G in one directory, G counting snapshots, and NAME.lock,
/// which admits one process at a time; the kernel releases it when the process dies. Symbolic links
/// are never followed.
///
/// A snapshot is written completely or not at all (temporary file, flushed, renamed), with a
/// checksum. An event is one write(), so a killed process leaves whole events and at most one torn
/// event at the end. Inputs during the writing of a snapshot go into the next journal: journals G,
/// G + 1, ... contain all inputs since snapshot G. A missing number means lost inputs.
class StateStore {
 public:
  /// Whether a snapshot is written and flushed in save() or in a background thread. A slow device
  /// needs seconds.
  enum class Saving : std::uint8_t { kAtOnce, kBeside };
  /// Result of a snapshot: none = saved.
  using Kept = std::optional<wire::Refusal>;

  /// `name`: name of the service. Accesses no file before open() or start_over().
  StateStore(std::filesystem::path directory, std::string name, Saving saving = Saving::kAtOnce);
  /// Waits for a snapshot in writing.
  ~StateStore();
  StateStore(const StateStore&) = delete;
  StateStore& operator=(const StateStore&) = delete;

  /// The saved state of an earlier process.
  struct Recovered {
    std::optional<std::string> snapshot;
    std::vector<JournalEvent> events;     ///< Inputs since the snapshot, in order.
    std::vector<wire::Refusal> problems;  ///< Damaged and lost parts.
  };
  /// Reads the files and continues the journal. If earlier recoveries died before end_recovery(),
  /// the journal is put aside, after further ones the snapshot too. Throws std::runtime_error with
  /// the name of the lock where another process uses these files.
  Recovered open();
  /// The stage has processed the result of open().
  void end_recovery();

  /// Puts all files aside and starts empty. Throws as open() does.
  void start_over();

  /// Appends one input to the journal, in one write(). Refused as kStateNotKept where the device
  /// fails; needs_snapshot() is then true.
  std::optional<wire::Refusal> append(std::string_view channel,
                                      std::span<const std::uint8_t> bytes);
  /// Writes a snapshot, which replaces the previous one and its journals; waits for a snapshot in
  /// writing. Refused as kStateNotKept where the device fails; the previous one then stays. With
  /// kBeside, finished() returns the result. Throws as open() does.
  std::optional<wire::Refusal> save(std::string state);
  /// Whether a snapshot is being written in the background.
  bool is_saving() const { return writing_.valid(); }
  /// Result of a snapshot written in the background; returned once. None before its end.
  std::optional<Kept> finished();

  /// True after a failed append: the journal lacks an input, and only a snapshot makes the state
  /// complete.
  bool needs_snapshot() const { return journal_broken_; }
  /// Writing time [s since 1970] of a snapshot that was put aside, if none has been saved since.
  std::optional<std::int64_t> lost_snapshot_s() const;
  /// Size of the journal [bytes].
  std::uint64_t journal_bytes() const { return journal_bytes_; }

 private:
  void lock();
  void report_links(Recovered& recovered) const;
  std::filesystem::path path(const std::string& suffix) const;
  std::filesystem::path journal_path(std::uint64_t generation) const;
  void put_aside(const std::filesystem::path& file);
  void refuse_what_killed_before(Recovered& recovered);
  std::uint64_t take_journals(Recovered& recovered);
  std::optional<wire::Refusal> open_journal(std::uint64_t valid_bytes);
  std::vector<std::uint64_t> journals() const;
  void keep_journals(std::uint64_t first, std::uint64_t last) const;
  Kept ended(Kept kept);
  Kept write_snapshot(std::uint64_t generation, const std::string& state) const;

  std::filesystem::path directory_;
  std::string name_;
  Saving saving_;
  std::uint64_t generation_ = 0;  ///< Number of the present journal.
  std::uint64_t newest_ = 0;      ///< Largest number used so far, failed ones included.
  std::future<Kept> writing_;     ///< Valid while a snapshot is written in the background.
  int journal_ = -1;
  int lock_ = -1;
  std::uint64_t journal_bytes_ = 0;
  bool journal_broken_ = false;
  /// Inputs before this journal are lost; only a snapshot completes the state.
  bool is_behind_hole_ = false;
};

}  // namespace understory::bus
