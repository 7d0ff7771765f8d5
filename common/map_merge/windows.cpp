#include "common/map_merge/windows.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/alignment.hpp"

namespace understory::map_merge {
namespace {

/// Largest number of motions to verify, the most certain ones.
constexpr std::size_t kMostHypotheses = 16;
/// Fewest landmarks of a window explained by its motion.
constexpr std::size_t kFewestInliers = 5;
/// Factor on the sigmas of a window's motion from its pairs alone, because the map may be deformed.
constexpr double kGenerous = 3.0;
/// A window's centre covers one of this many parts of its landmarks.
constexpr std::size_t kOverlapOfWindows = 3;

constellation::LocaliseParameters search_parameters() {
  constellation::LocaliseParameters parameters;
  // Neighbours differ between the maps where each lacks landmarks.
  parameters.neighbours = 8;
  parameters.expected_hit_ratio = 0.35;
  parameters.max_lookups = 100'000;
  return parameters;
}

/// A window's landmarks relative to their mean, axes as in the map.
struct Window {
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  std::vector<constellation::ObservedPoint> points;
};

Window window_of(const LandmarkSet& set, const std::vector<std::uint32_t>& members,
                 double most_sigma_m) {
  Window window;
  for (const std::uint32_t i : members) window.centre_m += set.all()[i].position_m;
  window.centre_m /= static_cast<double>(members.size());
  window.points.reserve(members.size());
  for (const std::uint32_t i : members) {
    const UncertainLandmark& one = set.all()[i];
    const double sigma_m = std::min(most_sigma_m, std::sqrt(one.variance_m2()));
    window.points.push_back({one.position_m - window.centre_m, sigma_m});
  }
  return window;
}

/// A hypothesis from the pairs of a window's best motion, accepted or not.
Hypothesis hypothesis_of(const constellation::ConstellationMap& map, const Window& window,
                         const constellation::Localisation& found) {
  geometry::RigidAlignment2 alignment;
  double moment = 0.0;
  double variance = 0.0;
  for (const auto& pair : found.associations) {
    const auto& point = window.points[pair.observed];
    alignment.add(*map.position(pair.landmark_id), point.position_m);
    moment += point.position_m.squaredNorm();
    variance += 2.0 * point.sigma_m * point.sigma_m + pair.distance_m * pair.distance_m;
  }

  const auto count = static_cast<double>(found.associations.size());
  const double mean = kGenerous * kGenerous * variance / count;
  geometry::SE2WithCovariance map_T_window{alignment.a_T_b()};
  map_T_window.covariance.diagonal() << mean / count, mean / count, mean / std::max(moment, 1.0);
  const geometry::SE2WithCovariance window_T_searched{
      geometry::SE2(Eigen::Vector2d(-window.centre_m), 0.0)};
  return {geometry::compound(map_T_window, window_T_searched), found.log10_false_alarm,
          found.associations.size()};
}

/// Whether both move the window of the first one to the same place.
bool is_same(const Hypothesis& a, const Hypothesis& b, double reach_m) {
  const Eigen::Vector3d between = (a.map_T_searched.mean.inverse() * b.map_T_searched.mean).Log();
  constexpr double kSame_m = 2.0;
  return between.head<2>().norm() < kSame_m + reach_m * std::abs(between.z()) &&
         std::abs(between.z()) < 0.05;
}

/// The most certain hypotheses, each motion once.
std::vector<Hypothesis> different_ones(std::vector<Hypothesis> all, const LandmarkSet& searched) {
  std::ranges::stable_sort(all, {}, &Hypothesis::log10_false_alarm);
  double reach_m = 0.0;
  for (const UncertainLandmark& one : searched.all())
    reach_m = std::max(reach_m, one.position_m.norm());

  std::vector<Hypothesis> result;
  for (const Hypothesis& one : all) {
    const bool is_known = std::ranges::any_of(
        result, [&](const Hypothesis& other) { return is_same(one, other, reach_m); });
    if (!is_known) result.push_back(one);
    if (result.size() == kMostHypotheses) break;
  }
  return result;
}

}  // namespace

WindowSearch search_windows(const constellation::ConstellationMap& map, const LandmarkSet& searched,
                            const WindowSize& size, const std::function<void(double)>& progress) {
  const constellation::LocaliseParameters parameters = search_parameters();
  WindowSearch search;
  std::vector<Hypothesis> all;
  std::vector<bool> is_covered(searched.all().size(), false);

  for (std::size_t i = 0; i < searched.all().size(); ++i) {
    if (is_covered[i]) continue;
    const auto members = searched.nearest(searched.all()[i].position_m, size.landmarks);
    const std::size_t inner = std::max<std::size_t>(1, members.size() / kOverlapOfWindows);
    for (std::size_t k = 0; k < inner; ++k) is_covered[members[k]] = true;

    const Window window = window_of(searched, members, size.most_sigma_m);
    const constellation::Localisation found = map.localise(window.points, parameters);
    ++search.windows;
    search.tried += found.hypotheses;
    progress(static_cast<double>(i) / static_cast<double>(searched.all().size()));
    if (found.associations.size() < kFewestInliers) continue;
    all.push_back(hypothesis_of(map, window, found));
  }

  search.hypotheses = different_ones(std::move(all), searched);
  return search;
}

}  // namespace understory::map_merge
