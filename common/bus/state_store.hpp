// A service's state on disk: a snapshot and the input events since. Together they survive SIGKILL
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

/// One input message as it came.
struct JournalEvent {
  std::string channel;
  std::vector<std::uint8_t> bytes;
};

/// Files NAME.snapshot and NAME.journal.G in one directory, G counting snapshots, and NAME.lock,
/// which the kernel releases when the process dies, however it does: one process at a time. A
/// symbolic link in place of one of them is never followed.
///
/// A snapshot is written whole or not at all (temporary file, flushed, renamed), with a checksum.
/// An event is one write(), so what a killed process leaves behind is whole events and at most one
/// torn one at the end. Inputs that come while a snapshot is written go into the next journal:
/// G, G + 1, ... together are what came since snapshot G. A number that is left out is a hole.
class StateStore {
 public:
  /// Where a snapshot is written and flushed: in save(), or in a thread beside it. A slow device
  /// takes seconds.
  enum class Saving : std::uint8_t { kAtOnce, kBeside };
  /// How a snapshot ended: none = it is kept.
  using Kept = std::optional<wire::Refusal>;

  /// `name`: the service's. Touches no file before open() or start_over().
  StateStore(std::filesystem::path directory, std::string name, Saving saving = Saving::kAtOnce);
  /// Waits for the snapshot that is being written.
  ~StateStore();
  StateStore(const StateStore&) = delete;
  StateStore& operator=(const StateStore&) = delete;

  /// What a process finds of its predecessor.
  struct Recovered {
    std::optional<std::string> snapshot;
    std::vector<JournalEvent> events;     ///< Since the snapshot, in order.
    std::vector<wire::Refusal> problems;  ///< What was damaged and is lost.
  };
  /// Reads what is there and starts to journal behind it. When earlier recoveries died on the way
  /// (begin_recovery without end_recovery), the journal is put aside, later the snapshot too.
  /// Throws std::runtime_error naming the lock where another process keeps its state here.
  Recovered open();
  /// The stage has taken what open() gave and lives.
  void end_recovery();

  /// Puts everything aside and starts empty. Throws as open() does.
  void start_over();

  /// Writes one input behind the snapshot, in one write(). Refused as kStateNotKept where the
  /// device fails; needs_snapshot() is then true.
  std::optional<wire::Refusal> append(std::string_view channel,
                                      std::span<const std::uint8_t> bytes);
  /// Writes a snapshot, which replaces the one before and its journals; waits for one that is being
  /// written. Refused as kStateNotKept where the device fails; the one before then stays. With
  /// kBeside the end is told by finished(). Throws as open() does.
  std::optional<wire::Refusal> save(std::string state);
  /// Whether a snapshot is being written beside.
  bool is_saving() const { return writing_.valid(); }
  /// The end of a snapshot that was written beside, once: kept or refused. None before.
  std::optional<Kept> finished();

  /// True after a failed append: the journal has a hole, only a snapshot makes the state whole.
  bool needs_snapshot() const { return journal_broken_; }
  /// Where a snapshot was put aside and none has been saved since: when it was written [s since
  /// 1970].
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
  std::uint64_t generation_ = 0;  ///< Of the journal that is written.
  std::uint64_t newest_ = 0;      ///< Of those that were begun, also in vain.
  std::future<Kept> writing_;     ///< Valid while a snapshot is written beside.
  int journal_ = -1;
  int lock_ = -1;
  std::uint64_t journal_bytes_ = 0;
  bool journal_broken_ = false;
  bool is_behind_hole_ = false;  ///< The journal follows a hole; only a snapshot makes up for it.
};

}  // namespace understory::bus
