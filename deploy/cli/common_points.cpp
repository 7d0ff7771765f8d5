#include "deploy/cli/common_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/io/data_error.hpp"
#include "common/io/lcm_log.hpp"
#include "common/io/table_headings.hpp"
#include "common/io/text_file.hpp"
#include "common/io/text_table.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "common/wire/convert.hpp"

namespace understory::cli {
namespace {

constexpr model::Utime kLongestGap_us = 2'000'000;

/// Index of a heading; none where the table has none.
std::optional<std::size_t> column_named(const io::TextTable& table, std::string_view name) {
  const auto& cells = table.heading.cells;
  const auto found = std::ranges::find(cells, name);
  if (found == cells.end()) return std::nullopt;
  return static_cast<std::size_t>(found - cells.begin());
}

/// The columns of a table of control points for positions in the map.
struct MapColumns {
  std::optional<std::size_t> x;
  std::optional<std::size_t> y;
  std::optional<std::size_t> id;
};

MapColumns map_columns(const io::TextTable& table) {
  const MapColumns columns{column_named(table, "map_x_m"), column_named(table, "map_y_m"),
                           column_named(table, "landmark_id")};
  const bool has_place = columns.x.has_value() && columns.y.has_value();
  if (!has_place && !columns.id)
    throw io::DataError(
        fmt::format("{}: neither map_x_m and map_y_m nor landmark_id says which point of the map a "
                    "control point is",
                    table.source));
  return columns;
}

Eigen::Vector2d landmark_named(const io::TextTable& table, const io::TextRow& row,
                               const std::string& id,
                               const std::vector<map_file::StoredMap>& maps) {
  for (const map_file::StoredMap& map : maps) {
    for (const map_file::StoredLandmark& one : map.landmarks)
      if (std::to_string(one.landmark.id) == id) return one.landmark.position_m;
  }
  throw io::DataError(fmt::format("{}, line {}: no landmark {} in the map", table.source, row.line,
                                  id.substr(0, 40)));
}

io::TableHeadings headings_of(const io::TextTable& table, const io::CoordinateUnit& unit) {
  try {
    return io::recognise_headings(table.heading.cells, {}, unit);
  } catch (const std::invalid_argument& error) {
    throw io::DataError(
        fmt::format("{}, line {}: {}", table.source, table.heading.line, error.what()));
  }
}

/// A fix by longitude and latitude [deg].
struct Fix {
  model::Utime utime = 0;
  Eigen::Vector2d at_deg = Eigen::Vector2d::Zero();
  double sigma_m = 0.0;
};

/// None where the message is damaged, without a fix, or without latitude and longitude.
std::optional<Fix> placed_fix(const wire::Bytes& bytes) {
  const auto fix = wire::decode_message<model::GnssFix>(bytes);
  const auto message = wire::decode_message<gnss_t>(bytes);
  if (!fix || !message || message->has_geodetic == 0) return std::nullopt;
  const bool is_place = std::isfinite(message->longitude_deg) &&
                        std::abs(message->longitude_deg) <= 360.0 &&
                        std::abs(message->latitude_deg) <= 90.0;
  if (!is_place) return std::nullopt;
  return Fix{fix->utime, {message->longitude_deg, message->latitude_deg}, fix->sigma_m};
}

/// The fixes of a log by channel, in order of time; checked fixes repeat the raw ones.
std::vector<Fix> fixes_in(const std::string& log) {
  std::array<std::vector<Fix>, 2> by_channel;
  io::LcmLogReader reader(log);
  terminal::Progress progress("reading " + log, static_cast<double>(reader.size_bytes()));
  while (const auto event = reader.next()) {
    terminal::throw_if_interrupted();
    progress.update(static_cast<double>(reader.position_bytes()));
    const bool is_raw = event->channel == "RAW_GNSS";
    if (!is_raw && event->channel != "GNSS") continue;
    if (const auto fix = placed_fix(event->data)) by_channel[is_raw ? 0 : 1].push_back(*fix);
  }
  reader.refuse_other_files();
  std::vector<Fix>& fixes = by_channel[0].empty() ? by_channel[1] : by_channel[0];
  std::ranges::sort(fixes, {}, &Fix::utime);
  return fixes;
}

/// Interpolates between the fixes before and after; none in a gap.
std::optional<Fix> fix_at(const std::vector<Fix>& fixes, model::Utime utime) {
  const auto after = std::ranges::lower_bound(fixes, utime, {}, &Fix::utime);
  if (after == fixes.end()) return std::nullopt;
  if (after->utime == utime) return *after;
  if (after == fixes.begin()) return std::nullopt;
  const Fix& before = *(after - 1);
  const model::Utime gap = after->utime - before.utime;
  if (gap > kLongestGap_us) return std::nullopt;
  const double share = static_cast<double>(utime - before.utime) / static_cast<double>(gap);
  Eigen::Vector2d step_deg = after->at_deg - before.at_deg;
  step_deg.x() = std::remainder(step_deg.x(), 360.0);  // Also across the date line.
  return Fix{utime, before.at_deg + share * step_deg, std::max(before.sigma_m, after->sigma_m)};
}

}  // namespace

NamedPoints control_points_in(const std::string& file, const std::string& system,
                              const std::vector<map_file::StoredMap>& maps) {
  const reference_system::SystemSummary summary = reference_system::summary_of(system);
  const io::TextTable table = io::parse_text_table(io::read_whole_file(file), file);
  if (table.heading.cells.empty()) throw io::DataError(file + ": no heading");
  const MapColumns columns = map_columns(table);
  const io::TableHeadings headings =
      headings_of(table, {summary.is_geographic, summary.is_geographic ? 1.0 : summary.unit, true});

  NamedPoints known;
  for (const io::TextRow& row : table.rows) {
    const auto number = [&](std::size_t place) {
      return io::number_in(table, row.line, table.heading.cells[place], row.cells[place]);
    };
    const auto coordinate = [&](io::LandmarkColumn column) {
      const io::FoundColumn& found = *headings.at(column);
      return found.unit_m * number(found.place) / summary.unit;
    };

    const bool is_by_id = columns.id && !row.cells[*columns.id].empty();
    if (!is_by_id && !(columns.x && columns.y))
      throw io::DataError(fmt::format("{}, line {}: no landmark_id", file, row.line));
    reference_system::CommonPoint& point = known.points.emplace_back();
    point.map_m = is_by_id ? landmark_named(table, row, row.cells[*columns.id], maps)
                           : Eigen::Vector2d(number(*columns.x), number(*columns.y));
    point.world = {coordinate(io::LandmarkColumn::kX), coordinate(io::LandmarkColumn::kY)};
    // Surveyed points have equal weight; a wrong one must be visible, not be ignored.
    point.sigma_m = 1e3;
    known.names.push_back(fmt::format("line {}", row.line));
  }
  return known;
}

NamedPoints fixes_at_keyframes(const std::string& log, const map_file::StoredMap& map,
                               const FixOptions& options) {
  const std::vector<Fix> fixes = fixes_in(log);
  if (fixes.empty())
    throw io::DataError(fmt::format("{}: no fix with latitude and longitude in it", log));
  NamedPoints known;
  for (const model::KeyframePose& pose : map.keyframes) {
    const auto fix = fix_at(fixes, pose.utime);
    if (!fix) continue;
    known.points.push_back({pose.map_T_vehicle * options.antenna_m, fix->at_deg,
                            std::max(fix->sigma_m, options.least_sigma_m)});
    known.names.push_back(fmt::format("keyframe {}", pose.keyframe_sequence));
  }
  if (known.points.empty())
    throw io::DataError(
        fmt::format("{}: none of its {} fixes is of the time of a keyframe of map {}: is it the "
                    "log of another drive?",
                    log, fixes.size(), map.map_id));
  return known;
}

}  // namespace understory::cli
