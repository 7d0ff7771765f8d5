#include "common/constellation/pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/constellation/chance.hpp"
#include "common/geometry/alignment.hpp"

namespace understory::constellation {
namespace {

constexpr int kMaxRounds = 8;
/// Rounds on the near points only.
constexpr int kNearRounds = 2;
/// Corners of the hypothesis's triangle: they are hits by construction.
constexpr double kGiven = 3.0;

/// If the probability of a landmark in a gate by chance is above this, narrower gates are tried.
constexpr double kCrowdedChance = 0.2;
/// Parts of the gate's half width.
constexpr std::array kNarrowGates{0.6, 0.35};
/// The choice among three counts adds this to the bound [decades].
constexpr double kOneOfThree = 0.48;
/// With this many points or more, a pose is first fitted to the kNearPoints around its first
/// pairs...
constexpr std::size_t kManyPoints = 100;
constexpr std::size_t kNearPoints = 48;
/// ... and to all points only if their bound on chance (log10) is below this.
constexpr double kPromising = -2.0;

/// Uncertainty of the motion, for the gates.
struct MotionUncertainty {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Mean of the pairs, sensor frame.
  double translation_variance = 0.0;
  double rotation_variance = 0.0;
};

geometry::SE2 align(const PreparedObservation& observation, const PointGrid& grid,
                    const std::vector<Pair>& pairs, MotionUncertainty& uncertainty) {
  geometry::RigidAlignment2 sums;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double moment = 0.0;

  for (const Pair& pair : pairs) {
    const PreparedPoint& point = observation.points[pair.point];
    const double weight = 1.0 / point.variance;
    sums.add(grid.position(pair.slot), point.position, weight);
    sum += weight * point.position;
    moment += weight * point.position.squaredNorm();
  }

  uncertainty.centre = sum / sums.weight();
  uncertainty.translation_variance = 1.0 / sums.weight();
  const double about_centre = moment - sums.weight() * uncertainty.centre.squaredNorm();
  uncertainty.rotation_variance = 1.0 / std::max(about_centre, 1.0);

  return sums.a_T_b();
}

double gate(const PreparedPoint& point, const MotionUncertainty& motion,
            const LocaliseParameters& parameters) {
  const double lever = (point.position - motion.centre).squaredNorm();
  const double variance =
      point.variance + motion.translation_variance + motion.rotation_variance * lever;
  return std::min(parameters.gate_sigmas * std::sqrt(variance), parameters.max_gate_m);
}

/// If two points have the same landmark, the closer point keeps it.
void make_one_to_one(std::vector<Pair>& pairs) {
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    if (a.slot != b.slot) return a.slot < b.slot;
    if (a.squared_m2 != b.squared_m2) return a.squared_m2 < b.squared_m2;
    return a.point < b.point;
  });
  const auto same = [](const Pair& a, const Pair& b) { return a.slot == b.slot; };
  pairs.erase(std::unique(pairs.begin(), pairs.end(), same), pairs.end());
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return a.point < b.point; });
}

std::vector<Pair> gather(const PreparedObservation& observation, const PointGrid& grid,
                         const geometry::SE2& map_T_sensor, const MotionUncertainty& motion,
                         const LocaliseParameters& parameters) {
  const Eigen::Matrix2d rotation = map_T_sensor.rotation();
  std::vector<Pair> pairs;
  pairs.reserve(observation.points.size());

  for (std::uint32_t i = 0; i < observation.points.size(); ++i) {
    const PreparedPoint& point = observation.points[i];
    const Eigen::Vector2d mapped = rotation * point.position + map_T_sensor.translation();
    Pair pair{i, kNoSlot, 0.0};
    pair.slot = nearest_slot(grid, mapped.x(), mapped.y(), gate(point, motion, parameters),
                             pair.squared_m2);
    if (pair.slot != kNoSlot) pairs.push_back(pair);
  }

  make_one_to_one(pairs);
  return pairs;
}

bool equal(const std::vector<Pair>& a, const std::vector<Pair>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Pair& l, const Pair& r) {
    return l.point == r.point && l.slot == r.slot;
  });
}

/// Probability that a random point hits a landmark, at the local density.
double mean_chance(const PreparedObservation& observation, const PointGrid& grid,
                   const geometry::SE2& map_T_sensor, const MotionUncertainty& motion,
                   const LocaliseParameters& parameters) {
  const Eigen::Vector2d centre = map_T_sensor * observation.centre;
  double count = 1.0;
  grid.for_each_within(centre.x(), centre.y(), observation.radius_m,
                       [&](Slot, double) { count += 1.0; });
  double area = 0.0;
  for (const PreparedPoint& point : observation.points) {
    const double radius = gate(point, motion, parameters);
    area += radius * radius;
  }
  area /= static_cast<double>(observation.points.size());
  return count * area / (observation.radius_m * observation.radius_m);
}

/// Computes the bound on chance for the pairs. In a dense area every wide gate contains a landmark,
/// so narrow gates are tried too, and the lowest bound counts.
void rate(FittedPose& fitted, const PreparedObservation& observation, const PointGrid& grid,
          const MotionUncertainty& motion, const LocaliseParameters& parameters) {
  if (fitted.pairs.size() < 3) return;
  fitted.mean_chance = mean_chance(observation, grid, fitted.map_T_sensor, motion, parameters);
  const double tries = static_cast<double>(observation.points.size()) - kGiven;
  fitted.log10_tail = log10_binomial_tail_bound(static_cast<double>(fitted.pairs.size()) - kGiven,
                                                tries, fitted.mean_chance);
  if (fitted.mean_chance < kCrowdedChance) return;

  for (const double width : kNarrowGates) {
    const auto hits = std::count_if(fitted.pairs.begin(), fitted.pairs.end(), [&](const Pair& p) {
      const double gate_m = width * gate(observation.points[p.point], motion, parameters);
      return p.squared_m2 <= gate_m * gate_m;
    });
    const double tail = log10_binomial_tail_bound(static_cast<double>(hits) - kGiven, tries,
                                                  width * width * fitted.mean_chance);
    fitted.log10_tail = std::min(fitted.log10_tail, tail + kOneOfThree);
  }
}

/// Rounds of fitting and gathering on all points of `observation`.
FittedPose fit_all(const PreparedObservation& observation, const PointGrid& grid,
                   std::vector<Pair> pairs, const LocaliseParameters& parameters,
                   int max_rounds = kMaxRounds) {
  FittedPose fitted;
  MotionUncertainty motion;
  for (int round = 0; round < max_rounds && pairs.size() >= 2; ++round) {
    fitted.map_T_sensor = align(observation, grid, pairs, motion);
    std::vector<Pair> next = gather(observation, grid, fitted.map_T_sensor, motion, parameters);
    fitted.lookups += static_cast<std::uint32_t>(observation.points.size());
    const bool settled = equal(pairs, next);
    // Only pairs of this round count: earlier ones were gathered with looser gates than the chance
    // below is computed for.
    pairs = std::move(next);
    if (settled || pairs.size() < 3) break;
  }

  fitted.pairs = std::move(pairs);
  rate(fitted, observation, grid, motion, parameters);
  return fitted;
}

Eigen::Vector2d centre_of(const PreparedObservation& observation, const std::vector<Pair>& pairs) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Pair& pair : pairs) sum += observation.points[pair.point].position;
  return sum / static_cast<double>(pairs.size());
}

/// The kNearPoints closest points as a separate observation; `observed` are their indices.
PreparedObservation points_around(const Eigen::Vector2d& centre,
                                  const PreparedObservation& observation) {
  std::vector<std::pair<double, std::uint32_t>> order;
  order.reserve(observation.points.size());
  for (std::uint32_t i = 0; i < observation.points.size(); ++i)
    order.emplace_back((observation.points[i].position - centre).squaredNorm(), i);
  std::nth_element(order.begin(), order.begin() + kNearPoints, order.end());

  PreparedObservation near;
  for (std::size_t k = 0; k < kNearPoints; ++k) near.observed.push_back(order[k].second);
  std::sort(near.observed.begin(), near.observed.end());
  for (const std::uint32_t i : near.observed) near.points.push_back(observation.points[i]);
  measure_extent(near);
  return near;
}

/// The pairs of near points, with indices into the near points.
std::vector<Pair> pairs_of(const PreparedObservation& near, const std::vector<Pair>& pairs) {
  std::vector<Pair> result;
  for (const Pair& pair : pairs) {
    const auto it = std::lower_bound(near.observed.begin(), near.observed.end(), pair.point);
    if (it == near.observed.end() || *it != pair.point) continue;
    result.push_back(pair);
    result.back().point = static_cast<std::uint32_t>(it - near.observed.begin());
  }
  return result;
}

}  // namespace

Slot nearest_slot(const PointGrid& grid, double x, double y, double gate_m, double& squared_m2) {
  Slot best = kNoSlot;
  grid.for_each_within(x, y, gate_m, [&](Slot slot, double squared) {
    if (best == kNoSlot || squared < squared_m2) {
      best = slot;
      squared_m2 = squared;
    }
  });
  return best;
}

FittedPose fit_pose(const PreparedObservation& observation, const PointGrid& grid,
                    const std::vector<Pair>& pairs, const LocaliseParameters& parameters) {
  if (observation.points.size() < kManyPoints) return fit_all(observation, grid, pairs, parameters);

  const PreparedObservation near = points_around(centre_of(observation, pairs), observation);
  FittedPose part = fit_all(near, grid, pairs_of(near, pairs), parameters, kNearRounds);
  for (Pair& pair : part.pairs) pair.point = near.observed[pair.point];
  if (part.log10_tail > kPromising) {
    part.pairs.clear();
    return part;
  }
  FittedPose whole = fit_all(observation, grid, part.pairs, parameters);
  whole.lookups += part.lookups;
  return whole;
}

FittedPose pairs_at(const PreparedObservation& observation, const PointGrid& grid,
                    const geometry::SE2& map_T_sensor, const std::vector<Pair>& pairs,
                    const LocaliseParameters& parameters) {
  FittedPose fitted;
  fitted.map_T_sensor = map_T_sensor;
  MotionUncertainty motion;
  align(observation, grid, pairs, motion);
  fitted.pairs = gather(observation, grid, map_T_sensor, motion, parameters);
  fitted.lookups = static_cast<std::uint32_t>(observation.points.size());
  rate(fitted, observation, grid, motion, parameters);
  return fitted;
}

bool same_pose(const FittedPose& a, const FittedPose& b) {
  std::size_t common = 0;
  auto other = b.pairs.begin();
  for (const Pair& pair : a.pairs) {
    while (other != b.pairs.end() && other->point < pair.point) ++other;
    if (other == b.pairs.end()) break;
    if (other->point == pair.point && other->slot == pair.slot) ++common;
  }
  return 2 * common > std::min(a.pairs.size(), b.pairs.size());
}

}  // namespace understory::constellation
