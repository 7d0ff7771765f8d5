// Maps as rows of the layers, and back.
#pragma once

#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/stored_map.hpp"

namespace understory::map_file {

/// Removes a map's rows from every content table; no effect where there is none.
void delete_map(const Connection& connection, std::uint32_t map_id);
/// Writes the rows of a new map with its checksum. Fault::kRefused where the map is invalid.
void insert_map(const Connection& connection, const StoredMap& map);
/// The map of this number. Fault::kRefused where there is none, kDamaged where its rows are
/// invalid. The checksum is not compared.
StoredMap select_map(const Connection& connection, std::uint32_t map_id);
/// Numbers of all maps, ascending. Fault::kDamaged where one is invalid.
std::vector<std::uint32_t> map_ids(const Connection& connection);

/// SHA-256 over all content of a map: its row without the checksum, its rows in every layer and its
/// states of existence, each value with its type, in the order of keys. A map without states has
/// the same sum as before states were introduced. In hexadecimal digits.
std::string checksum_of(const Connection& connection, std::uint32_t map_id);
/// The checksum stated in the map's row.
std::string stated_checksum(const Connection& connection, std::uint32_t map_id);
/// Writes the map's present checksum to its row.
void state_checksum(const Connection& connection, std::uint32_t map_id);
/// Throws Fault::kDamaged with the map's number where the two differ.
void verify_checksum(const Connection& connection, std::uint32_t map_id);

}  // namespace understory::map_file
