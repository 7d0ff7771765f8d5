#include "common/constellation/settle.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/constellation/mixture.hpp"

namespace understory::constellation {
namespace {

/// Distance from which a maximum attracts the pose, as standard deviations.
struct Reach {
  double translation_m;
  double rotation_rad;
};
constexpr Reach kNarrowReach{0.7, 0.02};
constexpr std::array kWideReaches{Reach{1.5, 0.05}, Reach{3.0, 0.1}};
/// Where a larger share of the points is explained, the wide reaches are not tried.
constexpr double kWellExplained = 0.8;
/// If the share of explained points changes by more than this, the climb is repeated with the new
/// share.
constexpr double kOtherShare = 0.05;
/// Two climbs ended at the same maximum: squared distance in sigmas.
constexpr double kSameMaximum = 9.0;

Mixture mixture_at(const PreparedObservation& observation, const PointGrid& grid,
                   const FittedPose& pose) {
  const double explained =
      static_cast<double>(pose.pairs.size()) / static_cast<double>(observation.points.size());
  const Eigen::Vector2d centre = pose.map_T_sensor * observation.centre;
  double landmarks = 1.0;
  grid.for_each_within(centre.x(), centre.y(), observation.radius_m,
                       [&](Slot, double) { landmarks += 1.0; });
  const double area_m2 = std::numbers::pi * observation.radius_m * observation.radius_m;
  return {std::clamp(explained, 0.3, 0.95), landmarks / area_m2};
}

std::vector<MixtureMode> maxima_around(const PreparedObservation& observation,
                                       const PointGrid& grid, const FittedPose& start,
                                       const Mixture& mixture) {
  const auto climb_by = [&](const Reach& reach) {
    const Spread spread{Eigen::Vector2d::Zero(), reach.translation_m * reach.translation_m,
                        reach.rotation_rad * reach.rotation_rad};
    return climb(observation, grid, start.map_T_sensor, mixture, spread);
  };
  std::vector<MixtureMode> maxima{climb(observation, grid, start.map_T_sensor, mixture, {}),
                                  climb_by(kNarrowReach)};
  if (mixture.share < kWellExplained) {
    for (const Reach& reach : kWideReaches) maxima.push_back(climb_by(reach));
  }
  return maxima;
}

bool is_less_likely(const MixtureMode& a, const MixtureMode& b) {
  return a.at.log_likelihood < b.at.log_likelihood;
}

}  // namespace

std::optional<SettledPose> settle(const PreparedObservation& observation, const PointGrid& grid,
                                  const FittedPose& start, const LocaliseParameters& parameters) {
  const Mixture first = mixture_at(observation, grid, start);
  const auto maxima = maxima_around(observation, grid, start, first);
  MixtureMode best = *std::max_element(maxima.begin(), maxima.end(), is_less_likely);
  const double log_likelihood = best.at.log_likelihood;
  SettledPose settled;
  settled.pose = pairs_at(observation, grid, best.map_T_sensor, start.pairs, parameters);
  settled.lookups = settled.pose.lookups;

  // More points are explained than at the start, so more of them determine the pose.
  const Mixture now = mixture_at(observation, grid, settled.pose);
  if (std::abs(now.share - first.share) > kOtherShare) {
    best = climb(observation, grid, best.map_T_sensor, now, {});
    settled.pose = pairs_at(observation, grid, best.map_T_sensor, settled.pose.pairs, parameters);
    settled.lookups += best.lookups + settled.pose.lookups;
  }

  const Eigen::Matrix3d information = best.at.information();
  const Eigen::LLT<Eigen::Matrix3d> factor(information);
  if (factor.info() != Eigen::Success) return std::nullopt;
  settled.covariance = information.inverse();

  for (const MixtureMode& other : maxima) {
    settled.lookups += other.lookups;
    const Eigen::Vector3d off = (best.map_T_sensor.inverse() * other.map_T_sensor).Log();
    if (off.dot(information * off) < kSameMaximum) continue;
    const double margin = (log_likelihood - other.at.log_likelihood) / std::numbers::ln10;
    settled.log10_margin = std::min(settled.log10_margin, margin);
  }
  return settled;
}

}  // namespace understory::constellation
