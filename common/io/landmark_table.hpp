// Surveyed landmarks as a table of text (CSV) with a heading.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/io/table_headings.hpp"
#include "common/model/map.hpp"

namespace understory::io {

/// A landmark of a table.
struct LandmarkRow {
  model::MapLandmark landmark;  ///< Without id; frame of the survey, in metres or in degrees.
  std::uint64_t line = 0;       ///< Line of the row, from 1.
};

/// Two landmarks close together.
struct ClosePair {
  std::size_t first = 0;  ///< The smaller index.
  std::size_t second = 0;
  double distance_m = 0.0;
};

/// Options of reading a table.
struct LandmarkTableOptions {
  double sigma_m = 0.1;  ///< Standard deviation of a row without one, in x and in y [m].
  std::vector<NamedColumn> columns;  ///< Columns named by the user.
  CoordinateUnit
      unit{};  ///< Unit of coordinates. Degrees are stored in `position_m`: longitude, latitude.
};

/// Content of a table.
struct LandmarkRows {
  std::vector<LandmarkRow> rows;
  std::vector<std::string> passed_over;  ///< Headings of columns that were not read.
  std::vector<std::string> remarks;      ///< Diameters below 1 cm or above 4 m, a line each.
};

/// Reads the columns x_m, y_m and, if present, sigma_m (standard deviation in x and in y, without
/// correlation), dbh_m (diameter at breast height) and kind (trunk or corner), in any order and
/// under the headings and units of table_headings.hpp; other columns are skipped and listed. The
/// text is a table of text_table.hpp. An empty cell means `sigma_m`, no diameter, a trunk. Throws
/// DataError with `source` and line for headings that are not recognised, a row with another number
/// of cells, values that are not finite numbers, coordinates beyond 1e8 m or farther than 200 km
/// from the first row's, a sigma outside 0 (exclusive) to 1 km, a diameter outside 0 to 20 m, an
/// unknown kind, and a table without rows.
LandmarkRows parse_landmark_table(std::string_view text, std::string_view source,
                                  const LandmarkTableOptions& options);

/// All pairs of landmarks nearer to each other than `distance_m`, in order of their indices.
std::vector<ClosePair> close_pairs(const std::vector<LandmarkRow>& rows, double distance_m);

}  // namespace understory::io
