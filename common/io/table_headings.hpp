// Headings of surveyors' tables: meaning and unit of each column.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace understory::io {

/// Meaning of a column in a table of landmarks.
enum class LandmarkColumn : std::size_t { kX, kY, kSigma, kDiameter, kKind };
inline constexpr std::size_t kLandmarkColumns = 5;

/// A column named by the user: `role` as in --columns (x, y, sigma_m, dbh_cm, kind, ...), and its
/// heading in the file.
struct NamedColumn {
  std::string role;
  std::string heading;
};

/// Unit of coordinates whose headings have no unit.
struct CoordinateUnit {
  bool is_degrees = false;  ///< Coordinates are longitude and latitude.
  double metres = 1.0;  ///< Metres per unit of a projected system, e.g. 0.3048006 (US survey feet).
  bool is_of_system = false;  ///< The unit, and the kind of foot, is from a reference system.
};

/// Index of a column, and the factor from its numbers to metres.
struct FoundColumn {
  std::size_t place = 0;
  double unit_m = 1.0;
};

/// The columns of a table.
struct TableHeadings {
  std::array<std::optional<FoundColumn>, kLandmarkColumns> columns;
  std::vector<std::string> passed_over;  ///< Headings of unknown columns.

  /// The place of that column; none where the table has no such column.
  const std::optional<FoundColumn>& at(LandmarkColumn column) const {
    return columns[static_cast<std::size_t>(column)];
  }
};

/// Reads "x=easting,dbh_cm=BHD" in the form of --columns. Throws std::invalid_argument with the
/// fault.
std::vector<NamedColumn> parse_named_columns(std::string_view text);

/// Recognises headings, ignoring case, blanks and underscores: x, east, easting, rechtswert; y,
/// north, northing, hochwert; dbh, bhd, diameter; radius; sigma; kind; for coordinates in degrees
/// longitude, lon; latitude, lat. A unit may follow: x_m, "BHD [cm]", dbh_in, y_ft. Coordinates
/// without one are in `unit`; a diameter, radius or sigma without one is refused. `named` columns
/// replace recognised ones. Throws std::invalid_argument (a text for the heading's line) where x or
/// y is missing (with the most similar heading), for a repeated column, a missing named one, an
/// unknown unit, and degrees where metres are required. Cost O(headings times known ones).
TableHeadings recognise_headings(std::span<const std::string> headings,
                                 std::span<const NamedColumn> named,
                                 const CoordinateUnit& unit = {});

}  // namespace understory::io
