#include "common/io/table_headings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

namespace understory::io {
namespace {

/// Kinds of tables that have a heading.
enum class Coordinates : std::uint8_t { kAny, kMetres, kDegrees };

struct KnownHeading {
  std::string_view name;
  LandmarkColumn column;
  Coordinates of = Coordinates::kAny;
  double factor = 1.0;  ///< Factor from its numbers to the column's unit.
};

constexpr auto kX = LandmarkColumn::kX;
constexpr auto kY = LandmarkColumn::kY;
constexpr auto kDiameter = LandmarkColumn::kDiameter;
constexpr auto kInMetres = Coordinates::kMetres;
constexpr auto kInDegrees = Coordinates::kDegrees;
constexpr std::array kKnownHeadings{KnownHeading{"x", kX, kInMetres},
                                    KnownHeading{"east", kX, kInMetres},
                                    KnownHeading{"easting", kX, kInMetres},
                                    KnownHeading{"utmeast", kX, kInMetres},
                                    KnownHeading{"rechtswert", kX, kInMetres},
                                    KnownHeading{"longitude", kX, kInDegrees},
                                    KnownHeading{"lon", kX, kInDegrees},
                                    KnownHeading{"lng", kX, kInDegrees},
                                    KnownHeading{"long", kX, kInDegrees},
                                    KnownHeading{"y", kY, kInMetres},
                                    KnownHeading{"north", kY, kInMetres},
                                    KnownHeading{"northing", kY, kInMetres},
                                    KnownHeading{"utmnorth", kY, kInMetres},
                                    KnownHeading{"hochwert", kY, kInMetres},
                                    KnownHeading{"latitude", kY, kInDegrees},
                                    KnownHeading{"lat", kY, kInDegrees},
                                    KnownHeading{"sigma", LandmarkColumn::kSigma},
                                    KnownHeading{"dbh", kDiameter},
                                    KnownHeading{"bhd", kDiameter},
                                    KnownHeading{"diameter", kDiameter},
                                    KnownHeading{"radius", kDiameter, Coordinates::kAny, 2.0},
                                    KnownHeading{"kind", LandmarkColumn::kKind}};

/// Names in --columns.
constexpr std::array<std::string_view, kLandmarkColumns> kRoleNames{"x", "y", "sigma", "dbh",
                                                                    "kind"};
/// Largest number of different letters for a similar heading.
constexpr std::size_t kNear = 3;

struct Unit {
  std::string_view name;
  double metres;
};
constexpr double kUsFoot_m = 1200.0 / 3937.0;
constexpr double kFoot_m = 0.3048;
constexpr std::array kUnits{Unit{"m", 1.0},          Unit{"cm", 0.01},       Unit{"mm", 0.001},
                            Unit{"in", 0.0254},      Unit{"inch", 0.0254},   Unit{"inches", 0.0254},
                            Unit{"ft", kFoot_m},     Unit{"foot", kFoot_m},  Unit{"feet", kFoot_m},
                            Unit{"usft", kUsFoot_m}, Unit{"ftus", kUsFoot_m}};
constexpr const char* kUnitNames = "m, cm, mm, in, ft";
constexpr std::array<std::string_view, 2> kDegreeUnits{"deg", "degrees"};

/// Metres per unit; none for a word that is not a unit of length.
std::optional<double> length_m(std::string_view word) {
  const auto* const found = std::ranges::find(kUnits, word, &Unit::name);
  return found == kUnits.end() ? std::nullopt : std::optional(found->metres);
}

bool is_foot(double unit_m) { return std::abs(unit_m - kFoot_m) < 1e-5; }

/// A normalised heading, and its unit.
struct PlainHeading {
  std::string name;
  std::string unit;  ///< Empty where none is written.
};

/// Small letters and digits; the last word is the unit if it is a known one or in brackets.
PlainHeading plain(std::string_view heading) {
  std::vector<std::string> words(1);
  bool has_brackets = false;
  for (const char c : heading) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else {
      has_brackets = has_brackets || c == '[' || c == '(';
      if (!words.back().empty()) words.emplace_back();
    }
  }
  if (words.back().empty() && words.size() > 1) words.pop_back();

  PlainHeading result;
  const bool is_unit =
      length_m(words.back()) || std::ranges::find(kDegreeUnits, words.back()) != kDegreeUnits.end();
  if (words.size() > 1 && (is_unit || has_brackets)) {
    result.unit = words.back();
    words.pop_back();
    // "BHD in cm"
    if (words.size() > 1 && words.back() == "in") words.pop_back();
  }
  for (const std::string& word : words) result.name += word;
  return result;
}

const KnownHeading* known_heading(std::string_view name) {
  const auto* const known = std::ranges::find(kKnownHeadings, name, &KnownHeading::name);
  return known == kKnownHeadings.end() ? nullptr : known;
}

bool is_of(const KnownHeading& known, const CoordinateUnit& unit) {
  return known.of == Coordinates::kAny || (known.of == kInDegrees) == unit.is_degrees;
}

bool is_coordinate(LandmarkColumn column) { return column == kX || column == kY; }

/// Feet are those of the reference system: there are several kinds, which differ by 4 m at 2,000
/// km.
std::optional<double> coordinate_unit(std::string_view written, const CoordinateUnit& unit) {
  if (written.empty()) return unit.is_degrees ? 1.0 : unit.metres;
  if (unit.is_degrees)
    return std::ranges::find(kDegreeUnits, written) != kDegreeUnits.end() ? std::optional(1.0)
                                                                          : std::nullopt;
  const std::optional<double> length = length_m(written);
  if (!length || !is_foot(*length) || !unit.is_of_system) return length;
  return is_foot(unit.metres) ? std::optional(unit.metres) : std::nullopt;
}

[[noreturn]] void refuse_unit(std::string_view written, std::string_view unit,
                              std::string_view known) {
  throw std::invalid_argument(
      fmt::format("column '{}': the unit '{}' is none of {}", written, unit, known));
}

double unit_m(const PlainHeading& heading, std::string_view written, LandmarkColumn column,
              const CoordinateUnit& unit) {
  if (column == LandmarkColumn::kKind) return 1.0;
  if (is_coordinate(column)) {
    const auto found = coordinate_unit(heading.unit, unit);
    if (!found)
      refuse_unit(written, heading.unit,
                  unit.is_degrees     ? "deg (the reference system has degrees)"
                  : unit.is_of_system ? "m, cm, mm (feet are for reference systems in feet)"
                                      : kUnitNames);
    return *found;
  }

  if (heading.unit.empty())
    throw std::invalid_argument(
        fmt::format("column '{}' has no unit: is it in m, cm, mm, in or ft? (--columns {}_cm={})",
                    written, column == kDiameter ? heading.name : "sigma", written));
  const std::optional<double> length = length_m(heading.unit);
  if (!length) refuse_unit(written, heading.unit, kUnitNames);
  return *length;
}

/// Letters that must be changed, added or left out to change one into the other (Levenshtein).
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, changed}));
    }
  }
  return row.back();
}

std::string missing_text(LandmarkColumn column, const std::vector<std::string>& passed_over,
                         const CoordinateUnit& unit) {
  const char* const role = column == kX ? "x" : "y";
  std::vector<std::string_view> known;
  std::string_view nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const KnownHeading& one : kKnownHeadings) {
    if (one.column != column || !is_of(one, unit)) continue;
    known.push_back(one.name);
    for (const std::string& heading : passed_over) {
      const std::size_t here = distance(plain(heading).name, one.name);
      if (here >= least) continue;
      least = here;
      nearest = heading;
    }
  }

  std::string text =
      fmt::format("no column for {}: headings that are known are {}", role, fmt::join(known, ", "));
  if (least <= kNear)
    text += fmt::format("; nearest is '{}' (--columns '{}={}')", nearest.substr(0, 40), role,
                        nearest.substr(0, 40));
  return text;
}

void take(TableHeadings& result, LandmarkColumn column, const FoundColumn& found,
          std::string_view heading) {
  auto& place = result.columns[static_cast<std::size_t>(column)];
  if (place)
    throw std::invalid_argument(fmt::format("column {} comes twice: '{}' is another one of it",
                                            kRoleNames[static_cast<std::size_t>(column)], heading));
  place = found;
}

void take_named(TableHeadings& result, std::span<const std::string> headings,
                const NamedColumn& one, const CoordinateUnit& coordinates) {
  const auto at = std::ranges::find(headings, one.heading);
  if (at == headings.end())
    throw std::invalid_argument(fmt::format("no column '{}' (--columns); there are {}", one.heading,
                                            fmt::join(headings, ", ")));
  const PlainHeading role = plain(one.role);
  const KnownHeading& known = *known_heading(role.name);
  const bool is_x_or_y = role.name == "x" || role.name == "y";
  if (!is_of(known, coordinates) && !is_x_or_y)
    throw std::invalid_argument(fmt::format("--columns {}={}: the reference system has {}",
                                            one.role, one.heading,
                                            coordinates.is_degrees ? "degrees" : "no degrees"));
  const std::string unit = plain(one.heading).unit;
  if (!role.unit.empty() && !unit.empty() && unit != role.unit)
    throw std::invalid_argument(
        fmt::format("--columns {}={}: the heading says {}", one.role, one.heading, unit));
  const auto place = static_cast<std::size_t>(at - headings.begin());
  const auto is_taken = [&](const auto& found) { return found && found->place == place; };
  if (std::ranges::any_of(result.columns, is_taken))
    throw std::invalid_argument(fmt::format("--columns: '{}' is named twice", one.heading));

  const PlainHeading with_unit{role.name, role.unit.empty() ? unit : role.unit};
  take(result, known.column,
       {place, known.factor * unit_m(with_unit, one.heading, known.column, coordinates)}, one.role);
}

/// Headings of the other kind of coordinates show which system is missing.
void refuse_missing(LandmarkColumn column, const std::vector<std::string>& passed_over,
                    const CoordinateUnit& unit) {
  for (const std::string& heading : passed_over) {
    const KnownHeading* const known = known_heading(plain(heading).name);
    if (known == nullptr || known->column != column || is_of(*known, unit)) continue;
    if (known->of == kInDegrees)
      throw std::invalid_argument(fmt::format(
          "column '{}' is in degrees: --crs EPSG:4326 (WGS 84, or the code of its own datum) "
          "converts it to metres",
          heading));
    throw std::invalid_argument(fmt::format(
        "column '{}': the reference system has degrees (columns lat and lon, or --columns "
        "lat=HEADING,lon=HEADING)",
        heading));
  }
  throw std::invalid_argument(missing_text(column, passed_over, unit));
}

/// "dbh_furlong" where no other column is the diameter: its unit is not known.
void refuse_unknown_units(const TableHeadings& found, const CoordinateUnit& unit) {
  for (const std::string& heading : found.passed_over) {
    const std::size_t cut = heading.find_last_of(" _-");
    if (cut == std::string::npos) continue;
    const KnownHeading* const known = known_heading(plain(heading.substr(0, cut)).name);
    if (known == nullptr || !is_of(*known, unit) || known->column == LandmarkColumn::kKind ||
        found.at(known->column))
      continue;
    const std::string word = heading.substr(cut + 1);
    const bool is_word =
        std::ranges::all_of(word, [](unsigned char letter) { return std::isalpha(letter) != 0; });
    if (is_word && !word.empty()) refuse_unit(heading, word, kUnitNames);
  }
}

}  // namespace

std::vector<NamedColumn> parse_named_columns(std::string_view text) {
  std::vector<NamedColumn> named;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view one = text.substr(begin, end - begin);
    begin = end + 1;
    const std::size_t sign = one.find('=');
    if (sign == std::string_view::npos || sign == 0 || sign + 1 == one.size())
      throw std::invalid_argument(fmt::format("'{}' is not of the form x=HEADING", one));
    const std::string role(one.substr(0, sign));
    if (known_heading(plain(role).name) == nullptr)
      throw std::invalid_argument(fmt::format(
          "'{}' is none of x, y, lat, lon, sigma_m, dbh_m (or _cm, _mm, _in, _ft), radius_m, kind",
          role));
    named.push_back({role, std::string(one.substr(sign + 1))});
  }
  return named;
}

TableHeadings recognise_headings(std::span<const std::string> headings,
                                 std::span<const NamedColumn> named, const CoordinateUnit& unit) {
  TableHeadings result;
  for (const NamedColumn& one : named) take_named(result, headings, one, unit);
  const std::array by_person = result.columns;

  for (std::size_t i = 0; i < headings.size(); ++i) {
    const auto is_named = [&](const auto& found) { return found && found->place == i; };
    if (std::ranges::any_of(by_person, is_named)) continue;
    const PlainHeading heading = plain(headings[i]);
    const KnownHeading* const known = known_heading(heading.name);
    if (known == nullptr || !is_of(*known, unit) ||
        by_person[static_cast<std::size_t>(known->column)]) {
      result.passed_over.emplace_back(headings[i]);
      continue;
    }
    take(result, known->column,
         {i, known->factor * unit_m(heading, headings[i], known->column, unit)}, headings[i]);
  }

  refuse_unknown_units(result, unit);
  for (const LandmarkColumn column : {kX, kY})
    if (!result.at(column)) refuse_missing(column, result.passed_over, unit);
  return result;
}

}  // namespace understory::io
