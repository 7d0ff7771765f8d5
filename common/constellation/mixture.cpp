#include "common/constellation/mixture.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::constellation {
namespace {

/// A landmark is left out if its weight is below this share of the weight of "no landmark".
constexpr double kNegligible = 0.01;
/// Largest distance at which a landmark counts [m], however wide the spread.
constexpr double kMaxReach_m = 3.0;
constexpr int kMaxClimbs = 30;
/// The spread's variances shrink by this factor per round.
constexpr double kCooling = 0.3;
/// A step shorter than this (in metres at the rim of the observation) ends the climb.
constexpr double kSettled_m = 1e-5;

using PointJacobian = Eigen::Matrix<double, 2, 3>;

}  // namespace

MixtureAt evaluate(const PreparedObservation& observation, const PointGrid& grid,
                   const geometry::SE2& map_T_sensor, const Mixture& mixture,
                   const Spread& spread) {
  MixtureAt at;
  const Eigen::Matrix2d rotation = map_T_sensor.rotation();
  for (const PreparedPoint& point : observation.points) {
    const double variance =
        point.variance + spread.translation_variance +
        spread.rotation_variance * (point.position - spread.centre).squaredNorm();
    const Eigen::Vector2d mapped = rotation * point.position + map_T_sensor.translation();
    const double peak =
        mixture.share / (mixture.density_per_m2 * 2.0 * std::numbers::pi * variance);

    double sum = 1.0 - mixture.share;
    Eigen::Vector2d first = Eigen::Vector2d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    const double least = kNegligible * (1.0 - mixture.share);
    const double reach =
        std::min(std::sqrt(2.0 * variance * std::log(std::max(peak / least, 1.1))), kMaxReach_m);
    grid.for_each_within(mapped.x(), mapped.y(), reach, [&](Slot slot, double squared) {
      const double weight = peak * std::exp(-0.5 * squared / variance);
      const Eigen::Vector2d off = grid.position(slot) - mapped;
      sum += weight;
      first += weight * off;
      second += weight * off * off.transpose();
    });
    ++at.lookups;
    at.log_likelihood += std::log(sum);

    const double matched = 1.0 - (1.0 - mixture.share) / sum;
    if (!(matched > 1e-6)) continue;
    first = rotation.transpose() * first / (sum * variance);
    second = rotation.transpose() * second * rotation / (sum * variance * variance);
    PointJacobian j;
    j << Eigen::Matrix2d::Identity(), geometry::perpendicular(point.position);
    at.gradient += j.transpose() * first;
    at.complete += j.transpose() * j * (matched / variance);
    at.missing += j.transpose() * (second - first * first.transpose()) * j;
  }
  return at;
}

MixtureMode climb(const PreparedObservation& observation, const PointGrid& grid,
                  const geometry::SE2& start, const Mixture& mixture, Spread spread) {
  MixtureMode mode{start, {}, 0};
  for (int round = 0; round < kMaxClimbs; ++round) {
    const MixtureAt at = evaluate(observation, grid, mode.map_T_sensor, mixture, spread);
    mode.lookups += at.lookups;
    const Eigen::Matrix3d damped = at.complete + 1e-6 * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d step = damped.ldlt().solve(at.gradient);
    mode.map_T_sensor = mode.map_T_sensor * geometry::SE2::Exp(step);

    const bool is_cold = spread.translation_variance == 0.0;
    const double moved = step.head<2>().norm() + std::abs(step.z()) * observation.radius_m;
    if (is_cold && moved < kSettled_m) break;
    spread.translation_variance *= kCooling;
    spread.rotation_variance *= kCooling;
    if (spread.translation_variance < 1e-4) {
      spread.translation_variance = 0.0;
      spread.rotation_variance = 0.0;
    }
  }
  mode.at = evaluate(observation, grid, mode.map_T_sensor, mixture);
  mode.lookups += mode.at.lookups;
  return mode;
}

}  // namespace understory::constellation
