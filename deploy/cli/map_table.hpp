// Tables of surveyed landmarks as maps: `map import` of a CSV file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/map_file/map_file.hpp"

namespace understory::cli {

/// How a table becomes a map.
struct MapTableOptions {
  std::string source;
  std::string columns;         ///< As --columns has it.
  std::string crs;             ///< Reference system of the table; empty: metres of a frame.
  std::vector<double> origin;  ///< Of the map, in the table's coordinates; empty: not given.
  std::uint32_t map_id = 0;    ///< 1 or more; 0 where the caller has still to choose.
  double sigma_m = 0.1;
  double near_m = 0.1;
  bool is_far_allowed = false;  ///< See check_area().
};

/// A map, and where its frame lies.
struct MapOfTable {
  map_file::StoredMap map;
  std::optional<model::MapReference> reference;
};

/// Reads a table. With a reference system, coordinates become metres of `frame`, or of a new frame
/// whose origin is near the middle of the table where there is none. Remarks (columns passed over,
/// landmarks close together, odd diameters, places outside of the system's area) go to stderr. Ends
/// the command where a name of a column is wrong; throws io::DataError and
/// reference_system::ReferenceError.
MapOfTable map_of_table(const MapTableOptions& options,
                        const std::optional<model::MapReference>& frame);

/// A remark to stderr where coordinates are outside of the area that their reference system is made
/// for. Throws io::DataError where that is more than 1,000 km and not allowed: then columns are
/// swapped, or it is another system.
void check_area(const std::string& source, const std::string& crs, const Eigen::Vector2d& at,
                bool is_far_allowed);

/// What is said of a frame's place, for people: "EPSG:25832, origin at latitude 51.03193,
/// longitude 7.59147".
std::string place_text(const model::MapReference& reference);

}  // namespace understory::cli
