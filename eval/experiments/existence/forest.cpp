#include "eval/experiments/existence/forest.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <fstream>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "eval/experiments/existence/csv.hpp"
#include "eval/experiments/existence/forest_drive.hpp"

namespace understory::eval::experiments::existence {
namespace {

constexpr double kForestDay_s = 86400.0;
constexpr double kYear_s = 365.25 * kForestDay_s;
constexpr double kLeastDiameter_cm = 10.0;

/// Lanes there and back over the whole plot; the first one is shifted by chance.
std::vector<Eigen::Vector2f> lanes(const std::vector<CensusStem>& stems,
                                   const ForestSetting& setting, std::mt19937_64& random) {
  Eigen::Vector2f low = stems.front().place_m, high = low;
  for (const CensusStem& stem : stems) {
    low = low.cwiseMin(stem.place_m);
    high = high.cwiseMax(stem.place_m);
  }
  const auto lane_m = static_cast<float>(setting.lane_m);
  const auto every_m = static_cast<float>(setting.scan_every_m);
  std::uniform_real_distribution<float> shift(0.0F, lane_m);
  std::vector<Eigen::Vector2f> places;
  for (float y = low.y() - lane_m + shift(random); y < high.y() + lane_m; y += lane_m)
    for (float x = low.x(); x < high.x(); x += every_m) places.emplace_back(x, y);
  return places;
}

/// Days since 1970 of YYYY-MM-DD.
std::optional<double> day_of(std::string_view date) {
  int year = 0, month = 0, day = 0;
  if (date.size() != 10) return std::nullopt;
  const auto read = [&](std::size_t from, std::size_t size, int& into) {
    return std::from_chars(date.data() + from, date.data() + from + size, into).ec == std::errc();
  };
  if (!read(0, 4, year) || !read(5, 2, month) || !read(8, 2, day)) return std::nullopt;
  const std::chrono::year_month_day when{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  return static_cast<double>(std::chrono::sys_days(when).time_since_epoch().count());
}

/// A census of one tree.
struct Visit {
  double day;
  std::string_view status;
};

/// Its intervals from the first "alive" to "dead" or the last census; "missing" says nothing.
void count_tree(const std::vector<Visit>& visits, Mortality& mortality) {
  std::optional<double> alive_day;
  for (const Visit& visit : visits) {
    const bool is_alive = visit.status == "alive";
    if (!is_alive && (visit.status != "dead" || !alive_day)) continue;
    if (!alive_day) {
      ++mortality.trees;
      alive_day = visit.day;
      continue;
    }
    const double dt_s = (visit.day - *alive_day) * kForestDay_s;
    mortality.rate.replace({}, {is_alive ? 0.0F : 1.0F, static_cast<float>(dt_s)});
    if (!is_alive) mortality.rate.replace({}, {0.0F, static_cast<float>(0.5 * dt_s)});
    mortality.tree_years += (is_alive ? 1.0 : 0.5) * dt_s / kYear_s;
    mortality.died += is_alive ? 0 : 1;
    if (!is_alive) return;
    alive_day = visit.day;
  }
}

}  // namespace

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<CensusStem> read_census(std::string_view csv) {
  std::vector<CensusStem> stems = read_both_censuses(csv);
  std::erase_if(stems, [](const CensusStem& stem) { return stem.is_new; });
  return stems;
}

std::vector<CensusStem> read_both_censuses(std::string_view csv) {
  CsvRows rows(csv);
  const std::size_t x = rows.column("x_m"), y = rows.column("y_m");
  const std::size_t first = rows.column("dbh_2008_cm"), second = rows.column("dbh_2014_cm");
  std::vector<CensusStem> stems;
  while (rows.next()) {
    const auto before_cm = rows.number(first), after_cm = rows.number(second);
    const auto x_m = rows.number(x), y_m = rows.number(y);
    const bool was = before_cm && *before_cm > kLeastDiameter_cm;
    const bool is = after_cm && *after_cm > kLeastDiameter_cm;
    if (!x_m || !y_m || (!was && !is)) continue;
    stems.push_back({.place_m = {static_cast<float>(*x_m), static_cast<float>(*y_m)},
                     .radius_m = static_cast<float>(0.005 * (was ? *before_cm : *after_cm)),
                     .is_gone = was && !after_cm,
                     .is_new = !was});
  }
  return stems;
}

History drive_forest(const std::vector<CensusStem>& stems, const ForestSetting& setting,
                     std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const StemGrid grid(stems, setting.range_m);
  History history;
  history.mapping_drives = 1;
  history.pass_recall = 1.0 - setting.pass_missed;
  history.false_rate = setting.false_rate;
  double gone = 0.0;
  for (const CensusStem& stem : stems) {
    history.points_m.emplace_back(stem.place_m.x(), stem.place_m.y(), 1.0F);
    gone += stem.is_gone && setting.is_changed ? 1.0 : 0.0;
  }
  history.gone_share = gone / static_cast<double>(stems.size());

  const auto drive_at = [&](double time_s, bool is_later) {
    ForestDrive drive(stems, grid, setting, is_later, random);
    for (const Eigen::Vector2f& place_m : lanes(stems, setting, random)) drive.scan(place_m);
    history.drives.push_back(drive.finish(time_s));
  };
  drive_at(0.0, false);
  for (int k = 0; k < setting.drives; ++k)
    drive_at((setting.is_changed ? 6.0 * kYear_s : kForestDay_s) + k * kForestDay_s,
             setting.is_changed);
  return history;
}

Mortality read_mortality(std::string_view csv) {
  CsvRows rows(csv);
  std::vector<std::pair<std::size_t, std::size_t>> columns;  // date, status
  for (int census = 1; census <= 7; ++census) {
    std::string name("c");
    name += std::to_string(census);
    columns.emplace_back(rows.column(name + "_date"), rows.column(name + "_status"));
  }

  Mortality mortality;
  while (rows.next()) {
    std::vector<Visit> visits;
    for (const auto& [date, status] : columns) {
      const auto day = day_of(rows.text(date));
      if (day) visits.push_back({*day, rows.text(status)});
    }
    count_tree(visits, mortality);
  }
  return mortality;
}

}  // namespace understory::eval::experiments::existence
