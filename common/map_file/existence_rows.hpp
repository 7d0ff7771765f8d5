// What the existence tracker goes on with, as rows of existence_states and existence_models.
#pragma once

#include <cstdint>
#include <optional>

#include "common/map_file/connection.hpp"
#include "common/map_file/stored_existence.hpp"

namespace understory::map_file {

/// Writes it for a map that the file has. Where the file has a newer one already, that stays; done
/// twice it is as done once.
void put_existence(const Connection& connection, std::uint32_t map_id,
                   const StoredExistence& existence);
/// That of a map; none where the file has none. Fault::kDamaged where rows can be none.
std::optional<StoredExistence> select_existence(const Connection& connection, std::uint32_t map_id);
/// Takes out all that is of a map.
void delete_existence(const Connection& connection, std::uint32_t map_id);

/// Landmarks of a map that have a state, and those of them that are not in use.
struct ExistenceCounts {
  std::uint64_t states = 0;
  std::uint64_t unused = 0;
};
/// Of a map; zero where the file has no such tables.
ExistenceCounts count_existence(const Connection& connection, std::uint32_t map_id);

/// Takes out the states of landmarks that are in no map any more, and what was learned in maps that
/// the file has no more.
void drop_lost_states(const Connection& connection);
/// At the end of a drive: drops lost states, hands those of landmarks that went over to another map
/// to that map, and shows the probabilities in the layer `landmarks`. O(states).
void settle_existence(const Connection& connection);

}  // namespace understory::map_file
