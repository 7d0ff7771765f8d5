// The baseline's pose estimation and association filter (GeoSLAM §4.3.3, algorithm 4).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "eval/baselines/hierarchy/matching.hpp"
#include "eval/baselines/hierarchy/similarity.hpp"
#include "eval/baselines/mapper/parameters.hpp"

namespace understory::eval::baselines::mapper {

/// A landmark of the keyframe where a hypothesis puts it.
struct PlacedLandmark {
  std::uint32_t local = 0;                               ///< Index in the keyframe.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
};

/// A pose with its associations.
struct PoseEstimate {
  hierarchy::Similarity map_T_base;
  /// Landmark of the keyframe, landmark of the map; ascending in the latter.
  std::vector<hierarchy::PointMatch> associations;
  std::vector<PlacedLandmark> unmatched;  ///< Candidates for discovery.
  std::uint32_t attempts = 0;             ///< Samples drawn.
};

/// The best of up to `max_pose_attempts` similarities through `pose_sample_size` of the `matches`;
/// none with fewer than `min_pose_associations`. Not refined on its associations. `local_m`: frame
/// of the keyframe's base; `map_m`: frame `map`. O(attempts * local * map).
std::optional<PoseEstimate> estimate_pose(std::span<const Eigen::Vector2d> local_m,
                                          std::span<const Eigen::Vector2d> map_m,
                                          std::span<const hierarchy::PointMatch> matches,
                                          const Parameters& parameters, std::mt19937& random);

/// What localise() found; without an estimate the reason why not.
struct Localisation {
  std::optional<PoseEstimate> estimate;
  std::string reason;
};

/// Algorithm 3 up to the pose: associations of polygons for a larger and larger tau until there are
/// `min_associations`, then estimate_pose(). `map`: the hierarchy of `map_m`. The samples are drawn
/// alike for every keyframe, as in the published code.
Localisation localise(std::span<const Eigen::Vector2d> local_m,
                      std::span<const Eigen::Vector2d> map_m, const hierarchy::Hierarchy& map,
                      const Parameters& parameters);

}  // namespace understory::eval::baselines::mapper
