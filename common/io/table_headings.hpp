// Headings of surveyors' tables: which column is what, and in which unit.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace understory::io {

/// What a column of a table of landmarks can be.
enum class LandmarkColumn : std::size_t { kX, kY, kSigma, kDiameter, kKind };
inline constexpr std::size_t kLandmarkColumns = 5;

/// A column that a person named: `role` as in --columns (x, y, sigma_m, dbh_cm, kind, ...), and the
/// heading that it has in the file.
struct NamedColumn {
  std::string role;
  std::string heading;
};

/// What coordinates are in, where their headings have no unit.
struct CoordinateUnit {
  bool is_degrees = false;    ///< Of longitude and latitude.
  double metres = 1.0;        ///< Of a projected system, e.g. 0.3048006 (US survey feet).
  bool is_of_system = false;  ///< A reference system says so, and which foot is meant.
};

/// Where a column stands, and what its numbers are multiplied by to be metres.
struct FoundColumn {
  std::size_t place = 0;
  double unit_m = 1.0;
};

/// The columns of a table.
struct TableHeadings {
  std::array<std::optional<FoundColumn>, kLandmarkColumns> columns;
  std::vector<std::string> passed_over;  ///< Headings of no column that is known.

  /// Where that column stands; none where the table has none.
  const std::optional<FoundColumn>& at(LandmarkColumn column) const {
    return columns[static_cast<std::size_t>(column)];
  }
};

/// Reads "x=easting,dbh_cm=BHD" as --columns has it. Throws std::invalid_argument with what is
/// wrong.
std::vector<NamedColumn> parse_named_columns(std::string_view text);

/// Recognises headings, whatever their case, blanks and underscores: x, east, easting, rechtswert;
/// y, north, northing, hochwert; dbh, bhd, diameter; radius; sigma; kind; where coordinates are
/// degrees, longitude, lon; latitude, lat. A unit stands behind: x_m, "BHD [cm]", dbh_in, y_ft.
/// Coordinates without one are in `unit`; a diameter, radius or sigma without one is refused, since
/// its unit is unknown. `named` columns count instead of what is recognised. Throws
/// std::invalid_argument (a text for the heading's line) where x or y is missing, with the heading
/// that is nearest; for a column that comes twice, a named one that is not there, an unknown unit,
/// and degrees where metres are wanted. Cost O(headings times known ones).
TableHeadings recognise_headings(std::span<const std::string> headings,
                                 std::span<const NamedColumn> named,
                                 const CoordinateUnit& unit = {});

}  // namespace understory::io
