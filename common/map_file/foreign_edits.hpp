// What other programs changed in a map file: in no history, and in no checksum.
#pragma once

#include <cstdint>

#include "common/map_file/connection.hpp"
#include "common/map_file/history.hpp"

namespace understory::map_file {

/// Whether every map is what the history says, and what its checksum says. Fault::kDamaged where
/// the history itself is damaged. O(all changes).
bool is_as_recorded(const Connection& connection, const Connection& recorded);

/// Writes what others changed into the history as a change of its own, whose number it gives, so
/// that it can be taken back. Rows stay as they are; each map gets the checksum of what it is now,
/// unless it cannot be read as one: then Fault::kDamaged with `must_be_maps`, else it stays as it
/// is. The database `recorded` is recorded_content(). In no transaction: it is one.
std::uint64_t record_foreign_edits(const Connection& connection, const Connection& recorded,
                                   const ChangeNote& note, bool must_be_maps);

}  // namespace understory::map_file
