// Changes by other programs in a map file, which are in no history and no checksum.
#pragma once

#include <cstdint>

#include "common/map_file/connection.hpp"
#include "common/map_file/history.hpp"

namespace understory::map_file {

/// Whether every map agrees with the history and with its checksum. Fault::kDamaged where the
/// history itself is damaged. O(all changes).
bool is_as_recorded(const Connection& connection, const Connection& recorded);

/// Records foreign changes in the history as a separate change, which can be reverted; returns its
/// number. Rows stay unchanged; each map gets the checksum of its present content. If a map is
/// unreadable: Fault::kDamaged with `must_be_maps`, else its checksum stays. The database
/// `recorded` is recorded_content(). This is a transaction; call it outside of one.
std::uint64_t record_foreign_edits(const Connection& connection, const Connection& recorded,
                                   const ChangeNote& note, bool must_be_maps);

}  // namespace understory::map_file
