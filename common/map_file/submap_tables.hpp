// The tables of a drive's submaps; schema version 2.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/schema.hpp"

namespace understory::map_file {

/// Values of understory_submaps.state.
inline constexpr std::string_view kAway = "away";          ///< It is only in the file.
inline constexpr std::string_view kBack = "back";          ///< The mapper has taken it back.
inline constexpr std::string_view kReplaced = "replaced";  ///< Its content is in a later submap.

/// Tables with poses and ties of submaps. A drive changes them outside of the history; later
/// changes (map_file.hpp) are recorded with them.
inline constexpr std::array<std::string_view, 2> kPlacementTables{"understory_submap_poses",
                                                                  "understory_closures"};

/// Keys of understory_meta in a drive's file.
namespace drive_key {
inline constexpr std::string_view kOpen =
    "drive_open";  ///< The file is open: the layers are being written.
inline constexpr std::string_view kNewest = "drive_utime";  ///< Stamp of the newest input [us].
inline constexpr std::string_view kSealed =
    "drive_change";  ///< Number of the latest change at sealing.
}  // namespace drive_key

/// The tables and their indexes. They are not content of maps: a drive's change does not include
/// them.
std::vector<SchemaObject> submap_objects();
/// Lists the tables among the GeoPackage's extensions.
void register_submap_tables(const Connection& connection);

}  // namespace understory::map_file
