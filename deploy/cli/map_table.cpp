#include "deploy/cli/map_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/constellation/grid.hpp"
#include "common/io/data_error.hpp"
#include "common/io/landmark_table.hpp"
#include "common/io/text_file.hpp"
#include "common/reference_system/reference_system.hpp"
#include "deploy/cli/failure.hpp"

namespace understory::cli {
namespace {

using reference_system::Transformation;
using Rows = std::vector<io::LandmarkRow>;

/// Largest number of remarks of one kind that are listed singly.
constexpr std::size_t kMostRemarks = 10;
/// A chosen origin is a multiple of this, in metres or in thousandths of a degree.
constexpr double kOriginStep = 100.0;
constexpr double kWidest_m = 2e5;
/// Systems are used outside of their areas: UTM zone 33 for all of Norway, 550 km beyond.
constexpr double kFarOutside_m = 1e6;
/// A more accurate transformation between datums is not mentioned [m].
constexpr double kWellKnown_m = 0.01;

void report(const MapTableOptions& options, const std::string& what) {
  fmt::print(stderr, "{}: {}\n", options.source, what);
}

void report_close_pairs(const MapTableOptions& options, const Rows& rows) {
  const std::vector<io::ClosePair> pairs = io::close_pairs(rows, options.near_m);
  for (std::size_t i = 0; i < std::min(pairs.size(), kMostRemarks); ++i)
    report(options, fmt::format("lines {} and {} are {:.3f} m apart", rows[pairs[i].first].line,
                                rows[pairs[i].second].line, pairs[i].distance_m));
  if (!pairs.empty())
    report(options, fmt::format("{} pairs of landmarks nearer than {} m: doubles?", pairs.size(),
                                options.near_m));
}

void report_remarks(const MapTableOptions& options, const std::vector<std::string>& remarks) {
  for (std::size_t i = 0; i < std::min(remarks.size(), kMostRemarks); ++i)
    report(options, remarks[i]);
  if (remarks.size() > kMostRemarks)
    report(options, fmt::format("{} more diameters like these", remarks.size() - kMostRemarks));
}

io::LandmarkRows rows_of(const MapTableOptions& options, const io::CoordinateUnit& unit) {
  std::vector<io::NamedColumn> columns;
  try {
    columns = io::parse_named_columns(options.columns);
  } catch (const std::invalid_argument& error) {
    wrong_usage(fmt::format("--columns: {}", error.what()));
  }
  io::LandmarkRows read = io::parse_landmark_table(
      io::read_whole_file(options.source), options.source, {options.sigma_m, columns, unit});
  if (!read.passed_over.empty())
    report(options,
           fmt::format("columns that were not read: {}", fmt::join(read.passed_over, ", ")));
  report_remarks(options, read.remarks);
  return read;
}

/// The given origin, or one near the middle; in the units of rows.
Eigen::Vector2d origin_for(const MapTableOptions& options, const Rows& rows, bool is_degrees) {
  const auto& given = options.origin;
  // Degrees are given in the usual order: latitude first.
  if (!given.empty())
    return is_degrees ? Eigen::Vector2d(given[1], given[0]) : Eigen::Vector2d(given[0], given[1]);
  Eigen::Vector2d low = rows.front().landmark.position_m;
  Eigen::Vector2d high = low;
  for (const io::LandmarkRow& row : rows) {
    low = low.cwiseMin(row.landmark.position_m);
    high = high.cwiseMax(row.landmark.position_m);
  }
  const double step = is_degrees ? 1e-3 : kOriginStep;
  return (0.5 / step * (low + high)).array().round().matrix() * step;
}

/// Makes longitudes continuous across the date line.
void count_on_from_first(Rows& rows) {
  const double first_deg = rows.front().landmark.position_m.x();
  for (io::LandmarkRow& row : rows) {
    double& longitude_deg = row.landmark.position_m.x();
    longitude_deg += 360.0 * std::round((first_deg - longitude_deg) / 360.0);
  }
}

/// Transforms rows from a system to metres of the frame.
void move_into(const MapTableOptions& options, const Transformation& into, double unit_m,
               Rows& rows) {
  for (io::LandmarkRow& row : rows) {
    Eigen::Vector2d& position = row.landmark.position_m;
    position = into.forward(position / unit_m);
    if (position.cwiseAbs().maxCoeff() > kWidest_m)
      throw io::DataError(fmt::format("{}, line {}: is {:.0f} km from the map's origin",
                                      options.source, row.line, 1e-3 * position.norm()));
  }
}

void report_accuracy(const MapTableOptions& options, const model::MapReference& frame,
                     const std::optional<double>& accuracy_m) {
  if (accuracy_m && *accuracy_m <= kWellKnown_m) return;
  report(options, fmt::format("from {} to the map's {} by a transformation that is good to {}",
                              options.crs, frame.system,
                              accuracy_m ? fmt::format("{} m", *accuracy_m) : "an unknown amount"));
}

map_file::StoredMap map_with_rows(const MapTableOptions& options, const Rows& rows) {
  map_file::StoredMap map;
  map.map_id = options.map_id;
  map.landmarks.reserve(rows.size());
  for (const io::LandmarkRow& row : rows) {
    map.landmarks.push_back({row.landmark, std::nullopt, std::nullopt});
    map.landmarks.back().landmark.id = map_file::landmark_id(options.map_id, map.landmarks.size());
  }
  return map;
}

/// A table in metres of a frame without a location.
MapOfTable map_in_metres(const MapTableOptions& options) {
  Rows rows = rows_of(options, {}).rows;
  report_close_pairs(options, rows);
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();
  if (!options.origin.empty()) origin_m = {options.origin[0], options.origin[1]};
  double farthest_m = 0.0;
  for (io::LandmarkRow& row : rows) {
    row.landmark.position_m -= origin_m;
    farthest_m = std::max(farthest_m, row.landmark.position_m.cwiseAbs().maxCoeff());
  }
  if (farthest_m > constellation::PointGrid::kMaxCoordinate)
    report(options,
           fmt::format("coordinates reach {:.0f} m: the map can be kept and exported, but nothing "
                       "is located farther than 2,000 km from its origin (--crs CODE says in which "
                       "reference system they are, --origin X,Y alone moves the origin there)",
                       farthest_m));
  return {map_with_rows(options, rows), std::nullopt};
}

}  // namespace

MapOfTable map_of_table(const MapTableOptions& options,
                        const std::optional<model::MapReference>& frame) {
  if (options.crs.empty()) return map_in_metres(options);
  const reference_system::SystemSummary system = reference_system::summary_of(options.crs);
  const io::CoordinateUnit unit{system.is_geographic, system.is_geographic ? 1.0 : system.unit,
                                true};
  Rows rows = rows_of(options, unit).rows;
  if (system.is_geographic) count_on_from_first(rows);

  // One factor converts rows in degrees or metres to the system's own units.
  const double unit_m = system.unit;
  const Eigen::Vector2d origin = origin_for(options, rows, system.is_geographic);
  const Eigen::Vector2d in_system =
      options.origin.empty() || system.is_geographic ? Eigen::Vector2d(origin / unit_m) : origin;
  const model::MapReference reference =
      frame ? *frame : reference_system::frame_at(options.crs, in_system);
  check_area(options.source, options.crs, rows.front().landmark.position_m / unit_m,
             options.is_far_allowed);

  const Transformation into = reference_system::into_frame(options.crs, reference);
  move_into(options, into, unit_m, rows);
  report_close_pairs(options, rows);
  report_accuracy(options, reference, into.accuracy_m());
  report(options, fmt::format("{} ({}), {}", system.code, system.name,
                              frame ? "into the frame of the file's maps" : place_text(reference)));
  return {map_with_rows(options, rows), reference};
}

void check_area(const std::string& source, const std::string& crs, const Eigen::Vector2d& at,
                bool is_far_allowed) {
  const auto outside = reference_system::outside_area(crs, at);
  if (!outside) return;
  if (outside->distance_m > kFarOutside_m && !is_far_allowed)
    throw io::DataError(
        fmt::format("{}: {} (--force takes it all the same)", source, outside->text));
  fmt::print(stderr, "{}: {}\n", source, outside->text);
}

std::string place_text(const model::MapReference& reference) {
  const double turned_deg = reference.rotation_rad * 180.0 / std::numbers::pi;
  return fmt::format(
      "origin of the map at latitude {:.7f}, longitude {:.7f} ({}){}", reference.latitude_deg,
      reference.longitude_deg, reference.system,
      reference.rotation_rad == 0.0
          ? std::string(", x points east")
          : fmt::format(", x points {:.4f} degrees to the left of east", turned_deg));
}

}  // namespace understory::cli
