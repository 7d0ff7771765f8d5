// The tables that keep the submaps of a drive; schema version 2.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/schema.hpp"

namespace understory::map_file {

/// understory_submaps.state: what has become of a submap.
inline constexpr std::string_view kAway = "away";          ///< It is here, and nowhere else.
inline constexpr std::string_view kBack = "back";          ///< The mapper has taken it back.
inline constexpr std::string_view kReplaced = "replaced";  ///< Its content is in a later one.

/// Tables that say where submaps are and what ties them. A drive changes them outside of the
/// history; a change that is made afterwards (map_file.hpp) is recorded with them.
inline constexpr std::array<std::string_view, 2> kPlacementTables{"understory_submap_poses",
                                                                  "understory_closures"};

/// Keys of understory_meta that a drive's file has.
namespace drive_key {
inline constexpr std::string_view kOpen = "drive_open";      ///< The layers are being written.
inline constexpr std::string_view kNewest = "drive_utime";   ///< Of the newest input [us].
inline constexpr std::string_view kSealed = "drive_change";  ///< Latest change when it was sealed.
}  // namespace drive_key

/// The tables and their indexes. They are no content of maps: no drive's change has them.
std::vector<SchemaObject> submap_objects();
/// Lists the tables among the GeoPackage's extensions.
void register_submap_tables(const Connection& connection);

}  // namespace understory::map_file
