// parse_stem_map of sim/forest.hpp.
#include <charconv>
#include <cmath>

#include "sim/forest.hpp"

namespace understory::sim {
namespace {

/// Limits of surveys: distance of the origin (UTM northings end at 1e7 m), extent, diameter of a
/// trunk. A value beyond is a damaged number, and a grid or a route over it would not fit into
/// memory.
constexpr double kFarthestM = 1e8;
constexpr double kWidestM = 2e5;
constexpr double kThickestM = 20.0;

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\"");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return cells;
}

std::optional<double> number(std::string_view cell) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

/// Column numbers of the used columns; -1 = missing.
struct Columns {
  int x = -1;
  int y = -1;
  int dbh = -1;
};
Columns columns_of(const std::vector<std::string_view>& header) {
  Columns columns;
  for (int i = 0; i < static_cast<int>(header.size()); ++i) {
    if (header[i] == "x_m") columns.x = i;
    if (header[i] == "y_m") columns.y = i;
    if (header[i] == "dbh_m") columns.dbh = i;
  }
  return columns;
}

/// Fault of a coordinate, given that of the first row; none if it is valid.
std::optional<std::string> fault_of(std::string_view column, double value_m, double first_m) {
  if (std::abs(value_m) > kFarthestM) {
    return std::string(column) + " is farther than 1e8 m from the origin";
  }
  if (std::abs(value_m - first_m) > kWidestM) {
    return std::string(column) + " is farther than 200 km from the first row's";
  }
  return std::nullopt;
}

void set_extent(Forest& forest) {
  forest.low_m = forest.high_m = forest.trunks_m.front();
  for (const Eigen::Vector2d& trunk : forest.trunks_m) {
    forest.low_m = forest.low_m.cwiseMin(trunk);
    forest.high_m = forest.high_m.cwiseMax(trunk);
  }
}

}  // namespace

StemMapResult parse_stem_map(std::string_view csv) {
  StemMapResult result;
  std::optional<Columns> columns;
  int line_number = 0;

  for (std::size_t begin = 0; begin < csv.size();) {
    const std::size_t end = std::min(csv.find('\n', begin), csv.size());
    const std::string_view line = trimmed(csv.substr(begin, end - begin));
    begin = end + 1;
    ++line_number;

    const auto failed = [&](std::string_view what) {
      return StemMapResult{{}, "line " + std::to_string(line_number) + ": " + std::string(what)};
    };

    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string_view> cells = cells_of(line);
    if (!columns) {
      columns = columns_of(cells);
      if (columns->x < 0 || columns->y < 0) return failed("the header has no x_m and y_m");
      continue;
    }

    const auto cell = [&](int column) -> std::optional<double> {
      if (column < 0 || column >= static_cast<int>(cells.size())) return std::nullopt;
      return number(cells[column]);
    };

    const auto x = cell(columns->x);
    const auto y = cell(columns->y);
    if (!x || !y) return failed("x_m or y_m is not a number");
    const Eigen::Vector2d at(*x, *y);
    const Eigen::Vector2d first =
        result.forest.trunks_m.empty() ? at : result.forest.trunks_m.front();
    if (const auto fault = fault_of("x_m", at.x(), first.x())) return failed(*fault);
    if (const auto fault = fault_of("y_m", at.y(), first.y())) return failed(*fault);

    const double dbh_m = cell(columns->dbh).value_or(0.0);
    if (dbh_m < 0.0) return failed("dbh_m is negative");
    if (dbh_m > kThickestM) return failed("dbh_m is thicker than 20 m");

    result.forest.trunks_m.push_back(at);
    result.forest.radii_m.push_back(0.5 * dbh_m);
  }

  if (result.forest.trunks_m.empty()) return {{}, "no stems"};
  set_extent(result.forest);

  return result;
}

}  // namespace understory::sim
