#include "common/io/table_headings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <stdexcept>
#include <utility>

namespace understory::io {
namespace {

struct KnownHeading {
  std::string_view name;
  LandmarkColumn column;
};

constexpr auto kX = LandmarkColumn::kX;
constexpr auto kY = LandmarkColumn::kY;
constexpr auto kDiameter = LandmarkColumn::kDiameter;
constexpr std::array kKnownHeadings{KnownHeading{"x", kX},
                                    KnownHeading{"east", kX},
                                    KnownHeading{"easting", kX},
                                    KnownHeading{"utmeast", kX},
                                    KnownHeading{"rechtswert", kX},
                                    KnownHeading{"y", kY},
                                    KnownHeading{"north", kY},
                                    KnownHeading{"northing", kY},
                                    KnownHeading{"utmnorth", kY},
                                    KnownHeading{"hochwert", kY},
                                    KnownHeading{"sigma", LandmarkColumn::kSigma},
                                    KnownHeading{"dbh", kDiameter},
                                    KnownHeading{"bhd", kDiameter},
                                    KnownHeading{"diameter", kDiameter},
                                    KnownHeading{"kind", LandmarkColumn::kKind}};

/// What --columns calls them.
constexpr std::array<std::string_view, kLandmarkColumns> kRoleNames{"x", "y", "sigma", "dbh",
                                                                    "kind"};
/// Letters by which a heading may differ from a known one to be meant for it.
constexpr std::size_t kNear = 3;

/// Headings of degrees.
constexpr std::array<std::string_view, 6> kDegrees{"lat", "latitude", "lon",
                                                   "lng", "long",     "longitude"};

struct Unit {
  std::string_view name;
  double metres;
};
constexpr std::array kUnits{Unit{"m", 1.0}, Unit{"cm", 0.01}, Unit{"mm", 0.001}};

/// A heading without what differs from table to table, and its unit.
struct PlainHeading {
  std::string name;
  std::string unit;  ///< Empty where none is written.
};

/// Small letters and digits; the last word is the unit where it is one, or stands in brackets.
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
  const bool is_unit = std::ranges::find(kUnits, words.back(), &Unit::name) != kUnits.end();
  if (words.size() > 1 && (is_unit || has_brackets)) {
    result.unit = words.back();
    words.pop_back();
  }
  for (const std::string& word : words) result.name += word;
  return result;
}

std::optional<LandmarkColumn> column_of(std::string_view name) {
  const auto* const known = std::ranges::find(kKnownHeadings, name, &KnownHeading::name);
  return known == kKnownHeadings.end() ? std::nullopt : std::optional(known->column);
}

bool is_coordinate(LandmarkColumn column) { return column == kX || column == kY; }

double unit_m(const PlainHeading& heading, std::string_view written, LandmarkColumn column) {
  if (column == LandmarkColumn::kKind) return 1.0;
  if (heading.unit.empty()) {
    if (is_coordinate(column)) return 1.0;
    throw std::invalid_argument(
        fmt::format("column '{}' has no unit: is it in m, cm or mm? (--columns {}_cm={})", written,
                    column == kDiameter ? "dbh" : "sigma", written));
  }
  const auto* const unit = std::ranges::find(kUnits, heading.unit, &Unit::name);
  if (unit == kUnits.end())
    throw std::invalid_argument(
        fmt::format("column '{}': the unit '{}' is none of m, cm, mm", written, heading.unit));
  return unit->metres;
}

/// Letters that must be changed, added or left out to make one of the other (Levenshtein).
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

std::string missing_text(LandmarkColumn column, const std::vector<std::string>& passed_over) {
  const char* const role = column == kX ? "x" : "y";
  std::vector<std::string_view> known;
  std::string_view nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const KnownHeading& one : kKnownHeadings) {
    if (one.column != column) continue;
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

void take_named(TableHeadings& result, std::span<const std::string_view> headings,
                const NamedColumn& one) {
  const auto at = std::ranges::find(headings, one.heading);
  if (at == headings.end())
    throw std::invalid_argument(fmt::format("no column '{}' (--columns); there are {}", one.heading,
                                            fmt::join(headings, ", ")));
  const PlainHeading role = plain(one.role);
  const LandmarkColumn column = *column_of(role.name);
  const std::string unit = plain(one.heading).unit;
  if (!role.unit.empty() && !unit.empty() && unit != role.unit)
    throw std::invalid_argument(
        fmt::format("--columns {}={}: the heading says {}", one.role, one.heading, unit));
  const auto place = static_cast<std::size_t>(at - headings.begin());
  const auto is_taken = [&](const auto& found) { return found && found->place == place; };
  if (std::ranges::any_of(result.columns, is_taken))
    throw std::invalid_argument(fmt::format("--columns: '{}' is named twice", one.heading));

  const PlainHeading with_unit{role.name, role.unit.empty() ? unit : role.unit};
  take(result, column, {place, unit_m(with_unit, one.heading, column)}, one.role);
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
    if (!column_of(plain(role).name))
      throw std::invalid_argument(
          fmt::format("'{}' is none of x, y, sigma_m, dbh_m (or _cm, _mm), kind", role));
    named.push_back({role, std::string(one.substr(sign + 1))});
  }
  return named;
}

TableHeadings recognise_headings(std::span<const std::string_view> headings,
                                 std::span<const NamedColumn> named) {
  TableHeadings result;
  for (const NamedColumn& one : named) take_named(result, headings, one);
  const std::array by_person = result.columns;

  for (std::size_t i = 0; i < headings.size(); ++i) {
    const auto is_named = [&](const auto& found) { return found && found->place == i; };
    if (std::ranges::any_of(by_person, is_named)) continue;
    const PlainHeading heading = plain(headings[i]);
    const auto column = column_of(heading.name);
    if (!column || by_person[static_cast<std::size_t>(*column)]) {
      result.passed_over.emplace_back(headings[i]);
      continue;
    }
    take(result, *column, {i, unit_m(heading, headings[i], *column)}, headings[i]);
  }

  for (const LandmarkColumn column : {kX, kY}) {
    if (result.at(column)) continue;
    for (const std::string& heading : result.passed_over) {
      if (std::ranges::find(kDegrees, plain(heading).name) != kDegrees.end())
        throw std::invalid_argument(fmt::format(
            "column '{}' is in degrees: convert it to metres (UTM, say) first", heading));
    }
    throw std::invalid_argument(missing_text(column, result.passed_over));
  }
  return result;
}

}  // namespace understory::io
