#include "eval/experiments/existence/worlds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "eval/experiments/existence/observer.hpp"

namespace understory::eval::experiments::existence {
namespace {

constexpr double kDay_s = 86400.0;

double unit_of(std::mt19937_64& random) {
  return std::uniform_real_distribution<double>(0.0, 1.0)(random);
}

Eigen::Vector3f random_place(const WorldSetting& setting, std::mt19937_64& random) {
  const auto x = static_cast<float>(setting.side_m * unit_of(random));
  const auto y = static_cast<float>(setting.side_m * unit_of(random));
  return {x, y, static_cast<float>(2.0 * unit_of(random))};
}

Segment random_segment(const WorldSetting& setting, double length_m, std::mt19937_64& random) {
  const Eigen::Vector2f middle = random_place(setting, random).head<2>();
  const double angle = std::numbers::pi * unit_of(random);
  const Eigen::Vector2f half = static_cast<float>(0.5 * length_m) *
                               Eigen::Vector2d(std::cos(angle), std::sin(angle)).cast<float>();
  return {middle - half, middle + half};
}

/// A loop through the world, not twice the same.
std::vector<Eigen::Vector3f> random_loop(const WorldSetting& setting, std::mt19937_64& random) {
  const double middle = 0.5 * setting.side_m;
  const double radius_m = setting.side_m * (0.22 + 0.16 * unit_of(random));
  const double wave = 0.15 + 0.15 * unit_of(random);
  const double phase = 2.0 * std::numbers::pi * unit_of(random);
  const int places = static_cast<int>(2.0 * std::numbers::pi * radius_m / setting.scan_every_m);
  std::vector<Eigen::Vector3f> loop;
  for (int k = 0; k < places; ++k) {
    const double turn = 2.0 * std::numbers::pi * k / places;
    const double r = radius_m * (1.0 + wave * std::sin(3.0 * turn + phase));
    loop.emplace_back(static_cast<float>(middle + r * std::cos(turn)),
                      static_cast<float>(middle + r * std::sin(turn)), 1.5F);
  }
  return loop;
}

std::vector<Eigen::Vector3f> line(const Eigen::Vector3f& from_m, const Eigen::Vector3f& to_m,
                                  double every_m) {
  const int steps = std::max(1, static_cast<int>((to_m - from_m).norm() / every_m));
  std::vector<Eigen::Vector3f> places;
  for (int k = 0; k <= steps; ++k)
    places.emplace_back(from_m +
                        (to_m - from_m) * (static_cast<float>(k) / static_cast<float>(steps)));
  return places;
}

History begin_history(const WorldSetting& setting) {
  History history;
  history.pass_recall = 1.0 - setting.pass_missed;
  history.false_rate = setting.false_rate;
  return history;
}

/// Points in a rectangle.
void scatter(History& history, int count, const Eigen::Vector2f& low_m,
             const Eigen::Vector2f& high_m, std::mt19937_64& random) {
  for (int i = 0; i < count; ++i) {
    const auto x = static_cast<float>(unit_of(random));
    const auto y = static_cast<float>(unit_of(random));
    const Eigen::Vector2f at = low_m + Eigen::Vector2f(x, y).cwiseProduct(high_m - low_m);
    history.points_m.emplace_back(at.x(), at.y(), static_cast<float>(2.0 * unit_of(random)));
  }
}

/// Around a rectangle, at a distance.
std::vector<Eigen::Vector3f> around(const Eigen::Vector2f& low_m, const Eigen::Vector2f& high_m,
                                    double every_m) {
  const Eigen::Vector3f a(low_m.x(), low_m.y(), 1.5F), b(high_m.x(), low_m.y(), 1.5F),
      c(high_m.x(), high_m.y(), 1.5F), d(low_m.x(), high_m.y(), 1.5F);
  std::vector<Eigen::Vector3f> places;
  for (const auto& side :
       {line(a, b, every_m), line(b, c, every_m), line(c, d, every_m), line(d, a, every_m)})
    places.insert(places.end(), side.begin(), side.end());
  return places;
}

}  // namespace

History make_history(const WorldSetting& setting, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  History history = begin_history(setting);
  history.gone_share = setting.changed;
  for (int i = 0; i < setting.points; ++i)
    history.points_m.push_back(random_place(setting, random));
  std::vector<Segment> walls;
  walls.reserve(static_cast<std::size_t>(setting.walls));
  for (int i = 0; i < setting.walls; ++i) walls.push_back(random_segment(setting, 15.0, random));

  Observer observer(setting, history.points_m, random);
  std::vector<bool> exists(history.points_m.size(), true);
  double time_s = 0.0;
  for (std::size_t k = 0; k < history.mapping_drives; ++k, time_s += kDay_s)
    history.drives.push_back(observer.drive(time_s, random_loop(setting, random), walls, exists));

  time_s += setting.gap_days * kDay_s;
  for (std::size_t i = 0; i < exists.size(); ++i) exists[i] = unit_of(random) >= setting.changed;
  for (int k = 0; k < setting.changed_drives; ++k, time_s += kDay_s) {
    std::vector<Segment> occluders = walls;
    for (int i = 0; i < setting.vans; ++i)
      occluders.push_back(random_segment(setting, 6.0, random));
    history.drives.push_back(
        observer.drive(time_s, random_loop(setting, random), occluders, exists));
  }
  return history;
}

History make_occlusion_trap(const WorldSetting& setting, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  History history = begin_history(setting);
  scatter(history, 20, {10.0F, -3.0F}, {14.0F, 3.0F}, random);   // behind the van
  scatter(history, 20, {10.0F, 10.0F}, {14.0F, 16.0F}, random);  // beside it
  Observer observer(setting, history.points_m, random);
  const std::vector<bool> all(history.points_m.size(), true);
  const auto route = around({-2.0F, -8.0F}, {22.0F, 24.0F}, setting.scan_every_m);
  history.drives.push_back(observer.drive(0.0, route, {}, all));
  history.drives.push_back(observer.drive(kDay_s, route, {}, all));

  const std::vector<Eigen::Vector3f> standing(3600, Eigen::Vector3f(0.0F, 0.0F, 1.5F));
  const std::vector<Segment> van{{{5.0F, -3.0F}, {5.0F, 3.0F}}};
  history.drives.push_back(observer.drive((1.0 + setting.gap_days) * kDay_s, standing, van, all));
  return history;
}

History make_clear_cut(const WorldSetting& setting, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  History history = begin_history(setting);
  scatter(history, 50, {0.0F, 5.0F}, {24.0F, 17.0F}, random);     // felled
  scatter(history, 20, {31.5F, 9.0F}, {38.5F, 10.0F}, random);    // behind the lorry
  scatter(history, 130, {-40.0F, 5.0F}, {-2.0F, 25.0F}, random);  // the rest of the forest
  history.gone_share = 0.25;
  Observer observer(setting, history.points_m, random);
  std::vector<bool> exists(history.points_m.size(), true);
  const auto route = around({-45.0F, 0.0F}, {60.0F, 30.0F}, setting.scan_every_m);
  history.drives.push_back(observer.drive(0.0, route, {}, exists));
  history.drives.push_back(observer.drive(kDay_s, route, {}, exists));

  std::fill_n(exists.begin(), 50, false);
  const auto past = line({-45.0F, 0.0F, 1.5F}, {60.0F, 0.0F, 1.5F}, setting.scan_every_m);
  const std::vector<Segment> lorry{{{26.5F, 8.5F}, {43.5F, 8.5F}}};
  history.drives.push_back(observer.drive((1.0 + setting.gap_days) * kDay_s, past, lorry, exists));
  return history;
}

}  // namespace understory::eval::experiments::existence
