#include "eval/experiments/existence/forest.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "eval/experiments/existence/csv.hpp"

namespace understory::eval::experiments::existence {
namespace {

constexpr double kForestDay_s = 86400.0;
constexpr double kYear_s = 365.25 * kForestDay_s;
constexpr double kLeastDiameter_cm = 10.0;

/// Stems by squares as wide as the sensor's range.
class StemGrid {
 public:
  StemGrid(const std::vector<CensusStem>& stems, double range_m) : range_m_(range_m) {
    for (std::uint32_t i = 0; i < stems.size(); ++i) cells_[cell_of(stems[i].place_m)].push_back(i);
  }
  std::vector<std::uint32_t> near(const Eigen::Vector2f& place_m) const {
    std::vector<std::uint32_t> found;
    const auto [column, row] = cell_of(place_m);
    for (int x = column - 1; x <= column + 1; ++x) {
      for (int y = row - 1; y <= row + 1; ++y) {
        const auto cell = cells_.find({x, y});
        if (cell == cells_.end()) continue;
        found.insert(found.end(), cell->second.begin(), cell->second.end());
      }
    }
    return found;
  }

 private:
  std::pair<int, int> cell_of(const Eigen::Vector2f& place_m) const {
    return {static_cast<int>(std::floor(place_m.x() / range_m_)),
            static_cast<int>(std::floor(place_m.y() / range_m_))};
  }
  double range_m_;
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> cells_;
};

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

/// One drive through the forest.
class ForestDrive {
 public:
  ForestDrive(const std::vector<CensusStem>& stems, const StemGrid& grid,
              const ForestSetting& setting, bool is_later, std::mt19937_64& random)
      : stems_(stems), grid_(grid), setting_(setting), is_later_(is_later), random_(random) {
    for (std::size_t i = 0; i < stems.size(); ++i)
      can_be_seen_.push_back(unit() >= setting.pass_missed);
    clear_.assign(stems.size(), 0);
    directions_.assign(stems.size(), 0);
  }

  DriveLooks run(double time_s) {
    DriveLooks drive;
    drive.time_s = time_s;
    for (const Eigen::Vector2f& place_m : lanes(stems_, setting_, random_)) scan(place_m, drive);
    for (std::size_t i = 0; i < stems_.size(); ++i)
      drive.truth.push_back({exists(i), clear_[i] >= 10 && std::popcount(directions_[i]) >= 3,
                             exists(i) && clear_[i] == 0});
    return drive;
  }

 private:
  struct InView {
    std::uint32_t stem;
    float distance_m;
    float bearing;
    float half_width;  ///< Angle [rad].
  };

  bool exists(std::size_t stem) const { return !(is_later_ && stems_[stem].is_gone); }
  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }

  std::vector<InView> in_view(const Eigen::Vector2f& place_m) const {
    std::vector<InView> view;
    for (const std::uint32_t i : grid_.near(place_m)) {
      const Eigen::Vector2f way = stems_[i].place_m - place_m;
      const float distance_m = way.norm();
      if (distance_m > setting_.range_m || distance_m < 0.7F) continue;
      view.push_back({i, distance_m, std::atan2(way.y(), way.x()),
                      std::asin(std::min(1.0F, stems_[i].radius_m / distance_m))});
    }
    std::sort(view.begin(), view.end(),
              [](const InView& a, const InView& b) { return a.distance_m < b.distance_m; });
    return view;
  }

  bool is_hidden(const std::vector<InView>& view, std::size_t index) const {
    for (std::size_t k = 0; k < index; ++k) {
      const float apart =
          std::remainder(view[k].bearing - view[index].bearing, 2.0F * std::numbers::pi_v<float>);
      if (std::abs(apart) < view[k].half_width && exists(view[k].stem)) return true;
    }
    return false;
  }

  void scan(const Eigen::Vector2f& place_m, DriveLooks& drive) {
    const std::vector<InView> view = in_view(place_m);
    for (std::size_t k = 0; k < view.size(); ++k) {
      const InView& one = view[k];
      LookEvent event;
      event.point = one.stem;
      event.look.from_point_m << place_m - stems_[one.stem].place_m, 0.5F;
      event.is_clear = !is_hidden(view, k);
      event.recall = setting_.recall_near + one.distance_m / setting_.range_m *
                                                (setting_.recall_far - setting_.recall_near);
      const bool is_false = unit() < setting_.false_rate;
      const bool is_detected = unit() < event.recall;
      event.is_seen =
          is_false || (exists(one.stem) && can_be_seen_[one.stem] && event.is_clear && is_detected);
      if (!event.is_clear) event.look.ray = understory::existence::Ray::kBlocked;
      drive.looks.push_back(event);
      if (!event.is_clear) continue;
      ++clear_[one.stem];
      const float turn = one.bearing / std::numbers::pi_v<float> + 1.0F;
      directions_[one.stem] |= 1U << (static_cast<unsigned>(turn * 4.0F) % 8U);
    }
  }

  const std::vector<CensusStem>& stems_;
  const StemGrid& grid_;
  const ForestSetting& setting_;
  bool is_later_;
  std::mt19937_64& random_;
  std::vector<bool> can_be_seen_;
  std::vector<int> clear_;
  std::vector<std::uint32_t> directions_;
};

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
  CsvRows rows(csv);
  const std::size_t x = rows.column("x_m"), y = rows.column("y_m");
  const std::size_t first = rows.column("dbh_2008_cm"), second = rows.column("dbh_2014_cm");
  std::vector<CensusStem> stems;
  while (rows.next()) {
    const auto diameter_cm = rows.number(first);
    const auto x_m = rows.number(x), y_m = rows.number(y);
    if (!diameter_cm || !x_m || !y_m || *diameter_cm <= kLeastDiameter_cm) continue;
    stems.push_back({{static_cast<float>(*x_m), static_cast<float>(*y_m)},
                     static_cast<float>(0.005 * *diameter_cm),
                     !rows.number(second).has_value()});
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

  history.drives.push_back(ForestDrive(stems, grid, setting, false, random).run(0.0));
  for (int k = 0; k < setting.drives; ++k)
    history.drives.push_back(
        ForestDrive(stems, grid, setting, setting.is_changed, random)
            .run((setting.is_changed ? 6.0 * kYear_s : kForestDay_s) + k * kForestDay_s));
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
