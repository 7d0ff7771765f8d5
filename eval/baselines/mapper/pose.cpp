#include "eval/baselines/mapper/pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

namespace understory::eval::baselines::mapper {
namespace {

/// The published code looks a little further than the range of the sensor [r].
constexpr double kRangeFactor = 1.1;
/// The published code seeds every keyframe's samples alike.
constexpr std::uint32_t kSampleSeed = 10;

/// Numbers of the map's landmarks in the max-norm box around `centre`.
std::vector<std::uint32_t> landmarks_near(std::span<const Eigen::Vector2d> map_m,
                                          const Eigen::Vector2d& centre, double half_side_m) {
  std::vector<std::uint32_t> near;
  for (std::uint32_t i = 0; i < map_m.size(); ++i) {
    if ((map_m[i] - centre).cwiseAbs().maxCoeff() < half_side_m) {
      near.push_back(i);
    }
  }
  return near;
}

/// What one hypothesis associates. A map landmark claimed twice is given up for good, and both
/// claimants count as unmatched.
struct Claims {
  std::map<std::uint32_t, PlacedLandmark> accepted;  ///< By map landmark.
  std::set<std::uint32_t> disputed;
  std::vector<PlacedLandmark> unmatched;

  void claim(std::uint32_t map_landmark, const PlacedLandmark& placed) {
    if (disputed.contains(map_landmark)) {
      unmatched.push_back(placed);
      return;
    }
    const auto [holder, free] = accepted.try_emplace(map_landmark, placed);
    if (!free) {
      disputed.insert(map_landmark);
      unmatched.push_back(placed);
      unmatched.push_back(holder->second);
      accepted.erase(holder);
    }
  }
};

Claims associate(std::span<const Eigen::Vector2d> local_m, std::span<const Eigen::Vector2d> map_m,
                 const hierarchy::Similarity& map_T_base, const Parameters& parameters) {
  const std::vector<std::uint32_t> near =
      landmarks_near(map_m, map_T_base.translation_m, kRangeFactor * parameters.sensor_range_m);

  Claims claims;
  if (near.empty()) {
    return claims;
  }
  for (std::uint32_t l = 0; l < local_m.size(); ++l) {
    const PlacedLandmark placed{l, map_T_base * local_m[l]};
    double least = std::numeric_limits<double>::infinity();
    std::uint32_t nearest = 0;
    for (const std::uint32_t candidate : near) {
      const double distance = (map_m[candidate] - placed.position_m).squaredNorm();
      if (distance < least) {
        least = distance;
        nearest = candidate;
      }
    }

    const double distance_m = std::sqrt(least);
    if (distance_m < parameters.association_distance_m) {
      claims.claim(nearest, placed);
    } else if (parameters.discovery_distance_m <= distance_m) {
      claims.unmatched.push_back(placed);
    }
  }
  return claims;
}

std::optional<hierarchy::Similarity> similarity_of_sample(
    std::span<const Eigen::Vector2d> local_m, std::span<const Eigen::Vector2d> map_m,
    std::span<const hierarchy::PointMatch> matches, std::span<const std::uint32_t> sample) {
  std::vector<Eigen::Vector2d> from;
  std::vector<Eigen::Vector2d> to;
  for (const std::uint32_t match : sample) {
    from.push_back(local_m[matches[match].local]);
    to.push_back(map_m[matches[match].other]);
  }
  return hierarchy::fit_similarity(from, to);
}

/// Algorithm 3, lines 5-7: a larger and larger tau until there are associations enough.
std::vector<hierarchy::PointMatch> match(std::span<const Eigen::Vector2d> local_m,
                                         const hierarchy::Hierarchy& map,
                                         const Parameters& parameters) {
  const hierarchy::Hierarchy local(local_m, parameters.descriptor_step);
  const hierarchy::HierarchyMatches matches(
      local, map,
      {parameters.max_descriptor_distance, parameters.max_side_difference,
       parameters.min_triangle_match_ratio});

  double tau = parameters.initial_descriptor_distance;
  while (true) {
    std::vector<hierarchy::PointMatch> pairs = matches.points(tau);
    tau += parameters.descriptor_distance_step;
    // Enough is gamma itself, as in the code; the thesis' loop asks for more than gamma.
    if (pairs.size() >= static_cast<std::size_t>(parameters.min_associations) ||
        tau > parameters.max_descriptor_distance) {
      return pairs;
    }
  }
}

}  // namespace

std::optional<PoseEstimate> estimate_pose(std::span<const Eigen::Vector2d> local_m,
                                          std::span<const Eigen::Vector2d> map_m,
                                          std::span<const hierarchy::PointMatch> matches,
                                          const Parameters& parameters, std::mt19937& random) {
  std::vector<std::uint32_t> order(matches.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto sample_size = static_cast<std::size_t>(parameters.pose_sample_size);
  if (order.size() < sample_size) {
    return std::nullopt;
  }

  const auto enough =
      static_cast<std::size_t>(parameters.early_exit_ratio * static_cast<double>(local_m.size()));
  PoseEstimate best;
  Claims best_claims;
  int attempt = 0;
  for (; attempt < parameters.max_pose_attempts && best_claims.accepted.size() <= enough;
       ++attempt) {
    std::shuffle(order.begin(), order.end(), random);
    const auto map_T_base = similarity_of_sample(
        local_m, map_m, matches, std::span<const std::uint32_t>(order).first(sample_size));
    if (!map_T_base) {
      continue;
    }

    Claims claims = associate(local_m, map_m, *map_T_base, parameters);
    if (claims.accepted.size() > best_claims.accepted.size()) {
      best_claims = std::move(claims);
      best.map_T_base = *map_T_base;
    }
  }

  if (best_claims.accepted.size() < static_cast<std::size_t>(parameters.min_pose_associations)) {
    return std::nullopt;
  }

  best.attempts = static_cast<std::uint32_t>(attempt);
  for (const auto& [map_landmark, placed] : best_claims.accepted) {
    best.associations.push_back({placed.local, map_landmark});
  }
  best.unmatched = std::move(best_claims.unmatched);
  return best;
}

Localisation localise(std::span<const Eigen::Vector2d> local_m,
                      std::span<const Eigen::Vector2d> map_m, const hierarchy::Hierarchy& map,
                      const Parameters& parameters) {
  const std::vector<hierarchy::PointMatch> matches = match(local_m, map, parameters);
  if (matches.size() < static_cast<std::size_t>(parameters.min_associations))
    return {std::nullopt, "too few associations of polygons"};

  std::mt19937 random(kSampleSeed);
  auto estimate = estimate_pose(local_m, map_m, matches, parameters, random);
  if (!estimate) return {std::nullopt, "no pose with enough associations"};
  return {std::move(estimate), {}};
}

}  // namespace understory::eval::baselines::mapper
