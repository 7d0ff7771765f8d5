#include "common/io/landmark_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "common/geometry/point_bins.hpp"
#include "common/io/data_error.hpp"
#include "common/io/text_table.hpp"

namespace understory::io {
namespace {

/// UTM northings end at 1e7 m; a larger coordinate is a damaged number.
constexpr double kFarthestCoordinateM = 1e8;
constexpr double kWidestSurveyM = 2e5;
constexpr double kThickestTrunkM = 20.0;
constexpr double kLargestSigmaM = 1e3;
constexpr double kThinnestTrunkM = 0.01;
constexpr double kUsualTrunkM = 4.0;

constexpr std::array<std::string_view, kLandmarkColumns> kLandmarkColumnNames{
    "x_m", "y_m", "sigma_m", "dbh_m", "kind"};

/// The landmarks of a table, row by row.
class LandmarkTable {
 public:
  LandmarkTable(const TextTable& table, const LandmarkTableOptions& options)
      : table_(table), options_(options) {
    if (table.heading.cells.empty())
      throw DataError(
          fmt::format("{}: no heading (x_m,y_m[,sigma_m][,dbh_m][,kind])", table.source));
    take_heading();
    for (const TextRow& row : table.rows) take_row(row);
    if (rows_.empty()) throw DataError(fmt::format("{}: no landmark in it", table.source));
  }

  LandmarkRows take() {
    return {std::move(rows_), std::move(headings_.passed_over), std::move(remarks_)};
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw DataError(fmt::format("{}, line {}: {}", table_.source, line_, why));
  }

  void take_heading() {
    line_ = table_.heading.line;
    try {
      headings_ = recognise_headings(table_.heading.cells, options_.columns, options_.unit);
    } catch (const std::invalid_argument& error) {
      refuse(error.what());
    }
  }

  void take_row(const TextRow& from) {
    line_ = from.line;
    const std::vector<std::string>& cells = from.cells;
    LandmarkRow row;
    row.line = line_;
    model::MapLandmark& landmark = row.landmark;
    landmark.position_m = {coordinate(cells, LandmarkColumn::kX),
                           coordinate(cells, LandmarkColumn::kY)};

    const double sigma =
        within(cells, LandmarkColumn::kSigma, kLargestSigmaM).value_or(options_.sigma_m);
    if (sigma == 0.0) refuse("sigma_m is 0: every estimate has an error");
    landmark.covariance_m2 = sigma * sigma * Eigen::Matrix2d::Identity();

    const double diameter_m =
        within(cells, LandmarkColumn::kDiameter, kThickestTrunkM).value_or(0.0);
    landmark.radius_m = 0.5 * diameter_m;
    if (diameter_m > 0.0 && (diameter_m < kThinnestTrunkM || diameter_m > kUsualTrunkM))
      remarks_.push_back(
          fmt::format("line {}, column '{}': {} is {:.4g} m of diameter: is it the unit?", line_,
                      heading_of(LandmarkColumn::kDiameter), cell(cells, LandmarkColumn::kDiameter),
                      diameter_m));
    landmark.kind = kind(cells);
    rows_.push_back(row);
  }

  std::string_view cell(const std::vector<std::string>& cells, LandmarkColumn column) const {
    const auto& found = headings_.at(column);
    return found ? std::string_view(cells[found->place]) : std::string_view();
  }

  std::string_view heading_of(LandmarkColumn column) const {
    return table_.heading.cells[headings_.at(column)->place];
  }

  std::string_view name_of(LandmarkColumn column) const {
    if (options_.unit.is_degrees && column == LandmarkColumn::kX) return "longitude";
    if (options_.unit.is_degrees && column == LandmarkColumn::kY) return "latitude";
    return kLandmarkColumnNames[static_cast<std::size_t>(column)];
  }

  /// In metres, or in degrees.
  double number(std::string_view text, LandmarkColumn column) const {
    const double value = number_in(table_, line_, name_of(column), text);
    const double unit_m = headings_.at(column)->unit_m;
    return unit_m == 1.0 ? value : unit_m * value;
  }

  double coordinate(const std::vector<std::string>& cells, LandmarkColumn column) const {
    const double value = number(cell(cells, column), column);
    if (options_.unit.is_degrees) {
      const double most = column == LandmarkColumn::kX ? 360.0 : 90.0;
      if (std::abs(value) > most)
        refuse(fmt::format("{} {} is not within -{} and {} degrees", name_of(column), value, most,
                           most));
      return value;
    }

    if (std::abs(value) > kFarthestCoordinateM)
      refuse(fmt::format("{} {} is farther than 1e8 m from the origin", name_of(column), value));
    const bool is_far =
        !rows_.empty() &&
        std::abs(value - rows_.front().landmark.position_m(static_cast<int>(column))) >
            kWidestSurveyM;
    if (is_far)
      refuse(
          fmt::format("{} {} is farther than 200 km from the first row's", name_of(column), value));
    return value;
  }

  /// None where the cell is empty.
  std::optional<double> within(const std::vector<std::string>& cells, LandmarkColumn column,
                               double most) const {
    const std::string_view text = cell(cells, column);
    if (text.empty()) return std::nullopt;
    const double value = number(text, column);
    if (!(value >= 0.0 && value <= most))
      refuse(fmt::format("{} {} is not within 0 and {} m", name_of(column), value, most));
    return value;
  }

  model::LandmarkKind kind(const std::vector<std::string>& cells) const {
    const std::string_view text = cell(cells, LandmarkColumn::kKind);
    if (text.empty() || text == "trunk") return model::LandmarkKind::kTrunk;
    if (text == "corner") return model::LandmarkKind::kCorner;
    refuse(fmt::format("kind '{}' is neither trunk nor corner", text.substr(0, 40)));
  }

  const TextTable& table_;
  const LandmarkTableOptions& options_;
  TableHeadings headings_;
  std::vector<LandmarkRow> rows_;
  std::vector<std::string> remarks_;
  std::uint64_t line_ = 0;
};

}  // namespace

LandmarkRows parse_landmark_table(std::string_view text, std::string_view source,
                                  const LandmarkTableOptions& options) {
  const TextTable table = parse_text_table(text, source);
  return LandmarkTable(table, options).take();
}

std::vector<ClosePair> close_pairs(const std::vector<LandmarkRow>& rows, double distance_m) {
  std::vector<ClosePair> pairs;
  if (!(distance_m > 0.0)) return pairs;
  std::vector<Eigen::Vector2d> points;
  points.reserve(rows.size());
  for (const LandmarkRow& row : rows) points.push_back(row.landmark.position_m);

  const geometry::PointBins bins(points, distance_m);
  for (std::size_t i = 0; i < points.size(); ++i) {
    bins.for_each_within(points[i], distance_m, [&](std::uint32_t other, double squared) {
      const double distance = std::sqrt(squared);
      if (other > i && distance < distance_m) pairs.push_back({i, other, distance});
    });
  }
  std::ranges::sort(pairs, {},
                    [](const ClosePair& pair) { return std::tuple(pair.first, pair.second); });
  return pairs;
}

}  // namespace understory::io
