// Maps as rows of the layers, and back.
#pragma once

#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/stored_map.hpp"

namespace understory::map_file {

/// Takes a map's rows out of every content table; nothing where there is none.
void delete_map(const Connection& connection, std::uint32_t map_id);
/// Writes the rows of a map that the tables do not have, with its checksum. Fault::kRefused where
/// the map has what no map can have.
void insert_map(const Connection& connection, const StoredMap& map);
/// The map of this number. Fault::kRefused where there is none, kDamaged where its rows cannot be
/// what was written. The checksum is not looked at.
StoredMap select_map(const Connection& connection, std::uint32_t map_id);
/// Numbers of all maps, ascending. Fault::kDamaged where one can be none.
std::vector<std::uint32_t> map_ids(const Connection& connection);

/// SHA-256 over all content of a map: its row but for the checksum, its rows in every layer and its
/// states of existence, each value with its type, in the order of keys. A map without states has
/// the sum that it had before there were any. In hexadecimal digits.
std::string checksum_of(const Connection& connection, std::uint32_t map_id);
/// The checksum that the map's row states.
std::string stated_checksum(const Connection& connection, std::uint32_t map_id);
/// States the checksum that the map has now.
void state_checksum(const Connection& connection, std::uint32_t map_id);
/// Throws Fault::kDamaged naming the map where the two differ.
void verify_checksum(const Connection& connection, std::uint32_t map_id);

}  // namespace understory::map_file
