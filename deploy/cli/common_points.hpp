// Common points of a map and the earth: control points, and fixes of a drive.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/map_file/stored_map.hpp"
#include "common/reference_system/placing.hpp"

namespace understory::cli {

/// Points with names for messages.
struct NamedPoints {
  std::vector<reference_system::CommonPoint> points;
  std::vector<std::string> names;
};

/// Control points of a table: `map_x_m` and `map_y_m`, or the `landmark_id` of a landmark of these
/// maps, and coordinates of the system under the headings of io::recognise_headings. Throws
/// io::DataError with the line.
NamedPoints control_points_in(const std::string& file, const std::string& system,
                              const std::vector<map_file::StoredMap>& maps);

/// Options of fixes at keyframes.
struct FixOptions {
  Eigen::Vector2d antenna_m = Eigen::Vector2d::Zero();  ///< Position in the vehicle: forward, left.
  double least_sigma_m = 0.5;                           ///< Least sigma of a fix.
};

/// The keyframes of a map with a position from the fixes of a log (RAW_GNSS, else GNSS),
/// interpolated between two fixes at most 2 s apart. Fixes without latitude and longitude are
/// skipped. Longitude and latitude are in WGS 84. Throws io::LogError.
NamedPoints fixes_at_keyframes(const std::string& log, const map_file::StoredMap& map,
                               const FixOptions& options);

}  // namespace understory::cli
