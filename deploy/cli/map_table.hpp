// Converts tables of surveyed landmarks to maps: `map import` of a CSV file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/map_file/map_file.hpp"

namespace understory::cli {

/// Options of converting a table to a map.
struct MapTableOptions {
  std::string source;
  std::string columns;  ///< In the form of --columns.
  std::string crs;      ///< Reference system of the table; empty = metres of a frame.
  std::vector<double>
      origin;                ///< Origin of the map, in the table's coordinates; empty = not given.
  std::uint32_t map_id = 0;  ///< 1 or more; 0 = the caller must still choose.
  double sigma_m = 0.1;
  double near_m = 0.1;
  bool is_far_allowed = false;  ///< See check_area().
};

/// A map, and the location of its frame.
struct MapOfTable {
  map_file::StoredMap map;
  std::optional<model::MapReference> reference;
};

/// Reads a table. With a reference system, coordinates become metres of `frame`, or without one of
/// a new frame with its origin near the middle of the table. Remarks (skipped columns, landmarks
/// close together, unusual diameters, positions outside of the system's area) go to stderr. Ends
/// the command where a column's name is wrong; throws io::DataError and
/// reference_system::ReferenceError.
MapOfTable map_of_table(const MapTableOptions& options,
                        const std::optional<model::MapReference>& frame);

/// Prints a remark to stderr where coordinates are outside of their reference system's area of use.
/// Throws io::DataError where the distance is more than 1,000 km and not allowed: then columns are
/// swapped, or the system is wrong.
void check_area(const std::string& source, const std::string& crs, const Eigen::Vector2d& at,
                bool is_far_allowed);

/// Text on a frame's location for people: "EPSG:25832, origin at latitude 51.03193, longitude
/// 7.59147".
std::string place_text(const model::MapReference& reference);

}  // namespace understory::cli
