// Decides when a service's inputs are journaled and when a snapshot is due.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/bus/state_store.hpp"
#include "common/wire/result.hpp"

namespace understory::bus {

/// Connects a node and its store. Without a store it saves nothing. Times are message time [us].
class StateKeeper {
 public:
  /// A snapshot is due after this much message time or this many inputs, whichever comes first.
  StateKeeper(std::int64_t every_us, int every_events)
      : every_us_(every_us), every_events_(every_events) {}

  /// From now on inputs go to the store, which must outlive the keeper; null = none.
  void journal_to(StateStore* store) {
    store_ = store;
    if (store != nullptr && store->needs_snapshot()) is_failing_ = true;
  }
  /// The state of time `utime` was loaded.
  void resume(std::int64_t utime) { saved_utime_ = period_start_ = utime; }
  /// Sets the number of inputs since that state.
  void set_events(int events) { events_ = events; }

  /// The store could not be opened for writing; treated like a refusal.
  void start_failed() { is_failing_ = true; }

  /// Journals an input before it is handled. Returns a refusal where the device fails.
  std::optional<wire::Refusal> append(std::string_view channel,
                                      std::span<const std::uint8_t> bytes);
  /// Whether a snapshot should be saved now.
  bool is_due(std::int64_t now);
  /// Saves the result of `make_state`, or starts to (StateStore::Saving). Does nothing without a
  /// store or before the first message (now < 0). Returns a refusal where the device fails or
  /// `make_state` throws.
  std::optional<wire::Refusal> save(std::int64_t now,
                                    const std::function<std::string()>& make_state);
  /// Result of a snapshot written in the background; returned once.
  std::optional<StateStore::Kept> settle();

  /// Whether something could not be saved and no later snapshot has replaced it.
  bool is_failing() const { return is_failing_; }
  /// Time of the last state saved or loaded; -1 = none.
  std::int64_t saved_utime() const { return saved_utime_; }
  /// Size of the journal; 0 without a store.
  std::int64_t journal_bytes() const;

 private:
  void kept();

  std::int64_t every_us_;
  int every_events_;
  StateStore* store_ = nullptr;
  std::int64_t saved_utime_ = -1;
  std::int64_t tried_utime_ = -1;
  std::int64_t period_start_ = -1;
  int events_ = 0;        // since the snapshot
  int saved_events_ = 0;  // of them before the snapshot in writing
  bool is_failing_ = false;
};

}  // namespace understory::bus
