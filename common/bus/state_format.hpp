// The bytes of snapshots and journals.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/state_store.hpp"

namespace understory::bus {

/// FNV-1a, 64 bit: detects damage, not forgery.
std::uint64_t checksum(std::string_view bytes);

/// Writes magic, version, generation, length, checksum, state.
std::string encode_snapshot(std::uint64_t generation, std::string_view state);
/// The content of a snapshot file.
struct Snapshot {
  std::uint64_t generation = 0;
  std::string state;
};
/// Refused as kSnapshotDamaged where any byte is wrong or missing.
wire::Result<Snapshot> decode_snapshot(std::string_view bytes);

/// Writes length, checksum, channel length, channel, data.
std::string encode_event(std::string_view channel, std::span<const std::uint8_t> bytes);
/// The events of a journal file and its readable length.
struct JournalContent {
  std::vector<JournalEvent> events;
  std::uint64_t valid_bytes = 0;  ///< Readable length; the rest is torn or damaged.
  bool is_torn = false;  ///< The last event is incomplete: the process was killed during the write.
  bool is_damaged = false;  ///< An event differs from its checksum.
};
/// Reads events up to the first that is torn or damaged; never fails.
JournalContent decode_journal(std::string_view bytes);

}  // namespace understory::bus
