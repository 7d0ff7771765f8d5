#include "common/io/landmark_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>

#include "common/geometry/point_bins.hpp"
#include "common/io/data_error.hpp"

namespace understory::io {
namespace {

/// UTM northings end at 1e7 m, and no survey reaches farther: what lies beyond is a damaged number.
constexpr double kFarthestCoordinateM = 1e8;
constexpr double kWidestSurveyM = 2e5;
constexpr double kThickestTrunkM = 20.0;
constexpr double kLargestSigmaM = 1e3;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

enum LandmarkColumn : std::size_t {
  kXColumn,
  kYColumn,
  kSigmaColumn,
  kDiameterColumn,
  kKindColumn,
  kLandmarkColumns
};
constexpr std::array<std::string_view, kLandmarkColumns> kLandmarkColumnNames{
    "x_m", "y_m", "sigma_m", "dbh_m", "kind"};

/// Without the blanks and quotation marks around it.
std::string_view bare_cell(std::string_view cell) {
  const auto first = cell.find_first_not_of(" \t\r\"");
  if (first == std::string_view::npos) return {};
  return cell.substr(first, cell.find_last_not_of(" \t\r\"") - first + 1);
}

std::vector<std::string_view> cells_of_line(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells.push_back(bare_cell(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return cells;
}

/// The table line by line.
class LandmarkTable {
 public:
  LandmarkTable(std::string_view text, std::string_view source, double default_sigma_m)
      : source_(source), default_sigma_m_(default_sigma_m) {
    if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view line = text.substr(begin, end - begin);
      begin = end + 1;
      ++line_;
      if (bare_cell(line).empty() || bare_cell(line).front() == '#') continue;
      is_headed_ ? take_row(cells_of_line(line)) : take_heading(cells_of_line(line));
    }

    if (!is_headed_)
      throw DataError(fmt::format("{}: no heading (x_m,y_m[,sigma_m][,dbh_m][,kind])", source_));
    if (rows_.empty()) throw DataError(fmt::format("{}: no landmark in it", source_));
  }

  std::vector<LandmarkRow> take() { return std::move(rows_); }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw DataError(fmt::format("{}, line {}: {}", source_, line_, why));
  }

  void take_heading(const std::vector<std::string_view>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const auto* const known = std::ranges::find(kLandmarkColumnNames, cells[i]);
      if (known == kLandmarkColumnNames.end())
        refuse(fmt::format("unknown column '{}'; known are {}", cells[i].substr(0, 40),
                           fmt::join(kLandmarkColumnNames, ", ")));
      auto& place = places_[static_cast<std::size_t>(known - kLandmarkColumnNames.begin())];
      if (place) refuse(fmt::format("column {} comes twice", cells[i]));
      place = i;
    }

    for (const LandmarkColumn column : {kXColumn, kYColumn}) {
      if (!places_[column]) refuse(fmt::format("no column {}", kLandmarkColumnNames[column]));
    }
    cells_ = cells.size();
    is_headed_ = true;
  }

  void take_row(const std::vector<std::string_view>& cells) {
    if (cells.size() != cells_)
      refuse(fmt::format("{} cells, the heading has {}", cells.size(), cells_));
    LandmarkRow row;
    row.line = line_;
    model::MapLandmark& landmark = row.landmark;
    landmark.position_m = {coordinate(cells, kXColumn), coordinate(cells, kYColumn)};
    const double sigma = within(cells, kSigmaColumn, kLargestSigmaM).value_or(default_sigma_m_);
    if (sigma == 0.0) refuse("sigma_m is 0: every estimate has an error");
    landmark.covariance_m2 = sigma * sigma * Eigen::Matrix2d::Identity();
    landmark.radius_m = 0.5 * within(cells, kDiameterColumn, kThickestTrunkM).value_or(0.0);
    landmark.kind = kind(cells);
    rows_.push_back(row);
  }

  std::string_view cell(const std::vector<std::string_view>& cells, LandmarkColumn column) const {
    return places_[column] ? cells[*places_[column]] : std::string_view();
  }

  double number(std::string_view text, LandmarkColumn column) const {
    double value = 0.0;
    const char* const end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, value);
    if (text.empty() || result.ec != std::errc{} || result.ptr != end || !std::isfinite(value))
      refuse(fmt::format("{} '{}' is no finite number", kLandmarkColumnNames[column],
                         text.substr(0, 40)));
    return value;
  }

  double coordinate(const std::vector<std::string_view>& cells, LandmarkColumn column) const {
    const double value = number(cell(cells, column), column);
    if (std::abs(value) > kFarthestCoordinateM)
      refuse(fmt::format("{} {} is farther than 1e8 m from the origin",
                         kLandmarkColumnNames[column], value));
    const bool is_far =
        !rows_.empty() &&
        std::abs(value - rows_.front().landmark.position_m(column)) > kWidestSurveyM;
    if (is_far)
      refuse(fmt::format("{} {} is farther than 200 km from the first row's",
                         kLandmarkColumnNames[column], value));
    return value;
  }

  /// None where the cell is empty.
  std::optional<double> within(const std::vector<std::string_view>& cells, LandmarkColumn column,
                               double most) const {
    const std::string_view text = cell(cells, column);
    if (text.empty()) return std::nullopt;
    const double value = number(text, column);
    if (!(value >= 0.0 && value <= most))
      refuse(
          fmt::format("{} {} is not within 0 and {} m", kLandmarkColumnNames[column], value, most));
    return value;
  }

  model::LandmarkKind kind(const std::vector<std::string_view>& cells) const {
    const std::string_view text = cell(cells, kKindColumn);
    if (text.empty() || text == "trunk") return model::LandmarkKind::kTrunk;
    if (text == "corner") return model::LandmarkKind::kCorner;
    refuse(fmt::format("kind '{}' is neither trunk nor corner", text.substr(0, 40)));
  }

  std::string source_;
  double default_sigma_m_;
  std::array<std::optional<std::size_t>, kLandmarkColumns> places_;
  std::vector<LandmarkRow> rows_;
  std::uint64_t line_ = 0;
  std::size_t cells_ = 0;
  bool is_headed_ = false;
};

}  // namespace

std::vector<LandmarkRow> parse_landmark_table(std::string_view text, std::string_view source,
                                              double default_sigma_m) {
  return LandmarkTable(text, source, default_sigma_m).take();
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
