#include "common/io/landmark_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

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

constexpr std::array<std::string_view, kLandmarkColumns> kLandmarkColumnNames{
    "x_m", "y_m", "sigma_m", "dbh_m", "kind"};

/// Without the blanks and quotation marks around it.
std::string_view bare_cell(std::string_view cell) {
  const auto first = cell.find_first_not_of(" \t\r\"");
  if (first == std::string_view::npos) return {};
  return cell.substr(first, cell.find_last_not_of(" \t\r\"") - first + 1);
}

/// What separates the cells: the first of semicolon, tab and comma that the heading has.
char delimiter_of(std::string_view heading) {
  for (const char one : {';', '\t'}) {
    if (heading.find(one) != std::string_view::npos) return one;
  }
  return ',';
}

/// A delimiter between quotation marks is none.
std::vector<std::string_view> cells_of_line(std::string_view line, char delimiter) {
  std::vector<std::string_view> cells;
  std::size_t begin = 0;
  bool is_quoted = false;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    if (i < line.size() && line[i] == '"') is_quoted = !is_quoted;
    if (i < line.size() && (is_quoted || line[i] != delimiter)) continue;
    cells.push_back(bare_cell(line.substr(begin, i - begin)));
    begin = i + 1;
  }
  return cells;
}

/// The table line by line.
class LandmarkTable {
 public:
  LandmarkTable(std::string_view text, std::string_view source, const LandmarkTableOptions& options)
      : source_(source), options_(options) {
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
      throw DataError(fmt::format("{}: UTF-16 text: save it as CSV in UTF-8", source_));
    if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view line = text.substr(begin, end - begin);
      begin = end + 1;
      ++line_;
      if (bare_cell(line).empty() || bare_cell(line).front() == '#') continue;
      headings_ ? take_row(cells_of_line(line, delimiter_)) : take_heading(line);
    }

    if (!headings_)
      throw DataError(fmt::format("{}: no heading (x_m,y_m[,sigma_m][,dbh_m][,kind])", source_));
    if (rows_.empty()) throw DataError(fmt::format("{}: no landmark in it", source_));
  }

  LandmarkRows take() { return {std::move(rows_), std::move(headings_->passed_over)}; }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw DataError(fmt::format("{}, line {}: {}", source_, line_, why));
  }

  void take_heading(std::string_view line) {
    delimiter_ = delimiter_of(line);
    const std::vector<std::string_view> cells = cells_of_line(line, delimiter_);
    try {
      headings_ = recognise_headings(cells, options_.columns);
    } catch (const std::invalid_argument& error) {
      refuse(error.what());
    }
    cells_ = cells.size();
  }

  void take_row(const std::vector<std::string_view>& cells) {
    if (cells.size() != cells_)
      refuse(fmt::format("{} cells, the heading has {}", cells.size(), cells_));
    LandmarkRow row;
    row.line = line_;
    model::MapLandmark& landmark = row.landmark;
    landmark.position_m = {coordinate(cells, LandmarkColumn::kX),
                           coordinate(cells, LandmarkColumn::kY)};
    const double sigma =
        within(cells, LandmarkColumn::kSigma, kLargestSigmaM).value_or(options_.sigma_m);
    if (sigma == 0.0) refuse("sigma_m is 0: every estimate has an error");
    landmark.covariance_m2 = sigma * sigma * Eigen::Matrix2d::Identity();
    landmark.radius_m =
        0.5 * within(cells, LandmarkColumn::kDiameter, kThickestTrunkM).value_or(0.0);
    landmark.kind = kind(cells);
    rows_.push_back(row);
  }

  std::string_view cell(const std::vector<std::string_view>& cells, LandmarkColumn column) const {
    const auto& found = headings_->at(column);
    return found ? cells[found->place] : std::string_view();
  }

  static std::string_view name_of(LandmarkColumn column) {
    return kLandmarkColumnNames[static_cast<std::size_t>(column)];
  }

  /// In metres. A comma is a decimal point where it does not separate cells.
  double number(std::string_view text, LandmarkColumn column) const {
    std::string with_point(text);
    if (delimiter_ != ',' && text.find('.') == std::string_view::npos)
      std::ranges::replace(with_point, ',', '.');
    double value = 0.0;
    const char* const end = with_point.data() + with_point.size();
    const auto result = std::from_chars(with_point.data(), end, value);
    if (text.empty() || result.ec != std::errc{} || result.ptr != end || !std::isfinite(value))
      refuse(fmt::format("{} '{}' is no finite number", name_of(column), text.substr(0, 40)));
    const double unit_m = headings_->at(column)->unit_m;
    return unit_m == 1.0 ? value : unit_m * value;
  }

  double coordinate(const std::vector<std::string_view>& cells, LandmarkColumn column) const {
    const double value = number(cell(cells, column), column);
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
  std::optional<double> within(const std::vector<std::string_view>& cells, LandmarkColumn column,
                               double most) const {
    const std::string_view text = cell(cells, column);
    if (text.empty()) return std::nullopt;
    const double value = number(text, column);
    if (!(value >= 0.0 && value <= most))
      refuse(fmt::format("{} {} is not within 0 and {} m", name_of(column), value, most));
    return value;
  }

  model::LandmarkKind kind(const std::vector<std::string_view>& cells) const {
    const std::string_view text = cell(cells, LandmarkColumn::kKind);
    if (text.empty() || text == "trunk") return model::LandmarkKind::kTrunk;
    if (text == "corner") return model::LandmarkKind::kCorner;
    refuse(fmt::format("kind '{}' is neither trunk nor corner", text.substr(0, 40)));
  }

  std::string source_;
  LandmarkTableOptions options_;
  std::optional<TableHeadings> headings_;
  std::vector<LandmarkRow> rows_;
  std::uint64_t line_ = 0;
  std::size_t cells_ = 0;
  char delimiter_ = ',';
};

}  // namespace

LandmarkRows parse_landmark_table(std::string_view text, std::string_view source,
                                  const LandmarkTableOptions& options) {
  return LandmarkTable(text, source, options).take();
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
