#include "common/constellation/pose.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/constellation/chance.hpp"
#include "common/geometry/alignment.hpp"

namespace understory::constellation {
namespace {

constexpr int kMaxRounds = 8;
/// Corners of the triangle that gave the hypothesis: hits by construction.
constexpr double kGiven = 3.0;

/// How well the motion is known, as far as gates need it.
struct MotionUncertainty {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Of the pairs, sensor frame.
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

/// Of two points that claim one landmark the closer one keeps it.
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

/// Probability that a point dropped at random hits a landmark, at the density found there.
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
  return std::min(1.0, count * area / (observation.radius_m * observation.radius_m));
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
                    std::vector<Pair> pairs, const LocaliseParameters& parameters) {
  FittedPose fitted;
  MotionUncertainty motion;
  for (int round = 0; round < kMaxRounds; ++round) {
    fitted.map_T_sensor = align(observation, grid, pairs, motion);
    std::vector<Pair> next = gather(observation, grid, fitted.map_T_sensor, motion, parameters);
    const bool settled = equal(pairs, next);
    // Only pairs of this round count: earlier ones were gathered with looser gates than the chance
    // below is computed for.
    pairs = std::move(next);
    if (settled || pairs.size() < 3) break;
  }

  fitted.pairs = std::move(pairs);
  if (fitted.pairs.size() < 3) return fitted;

  fitted.mean_chance = mean_chance(observation, grid, fitted.map_T_sensor, motion, parameters);
  fitted.log10_tail = log10_binomial_tail_bound(
      static_cast<double>(fitted.pairs.size()) - kGiven,
      static_cast<double>(observation.points.size()) - kGiven, fitted.mean_chance);

  return fitted;
}

Eigen::Matrix3d pose_covariance(const PreparedObservation& observation, const FittedPose& pose) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const Pair& pair : pose.pairs) {
    const PreparedPoint& point = observation.points[pair.point];
    Eigen::Matrix<double, 2, 3> j;
    j << Eigen::Matrix2d::Identity(), geometry::perpendicular(point.position);
    information += j.transpose() * j / point.variance;
  }
  return information.inverse();
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
