// The existence tracker's saved state as rows of existence_states and existence_models.
#pragma once

#include <cstdint>
#include <optional>

#include "common/map_file/connection.hpp"
#include "common/map_file/stored_existence.hpp"

namespace understory::map_file {

/// Writes the state of a map in the file. A newer state in the file stays; a repeated call has no
/// further effect.
void put_existence(const Connection& connection, std::uint32_t map_id,
                   const StoredExistence& existence);
/// Reads the state of a map; none where the file has none. Fault::kDamaged where rows are invalid.
std::optional<StoredExistence> select_existence(const Connection& connection, std::uint32_t map_id);
/// Removes the state of a map.
void delete_existence(const Connection& connection, std::uint32_t map_id);

/// Number of landmarks of a map with a state, and of those not in use.
struct ExistenceCounts {
  std::uint64_t states = 0;
  std::uint64_t unused = 0;
};
/// The counts of a map; zero where the file has no such tables.
ExistenceCounts count_existence(const Connection& connection, std::uint32_t map_id);

/// Removes states of landmarks that are no longer in a map, and learned values of maps no longer in
/// the file.
void drop_lost_states(const Connection& connection);
/// At the end of a drive: drops lost states, moves states of landmarks that are now in another map
/// to that map, and shows the probabilities in the layer `landmarks`. O(states).
void settle_existence(const Connection& connection);

}  // namespace understory::map_file
