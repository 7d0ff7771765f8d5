// The baseline's pose estimation and association filter (GeoSLAM §4.3.3, algorithm 4).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "common/hierarchy/baseline/matching.hpp"
#include "common/hierarchy/baseline/similarity.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper::baseline {

/// A landmark of the keyframe where a hypothesis puts it.
struct PlacedLandmark {
  std::uint32_t local = 0;                               ///< Index in the keyframe.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
};

/// A pose with its associations.
struct PoseEstimate {
  hierarchy::baseline::Similarity map_T_base;
  /// Landmark of the keyframe, landmark of the map; ascending in the latter.
  std::vector<hierarchy::baseline::PointMatch> associations;
  std::vector<PlacedLandmark> unmatched;  ///< Candidates for discovery.
  std::uint32_t attempts = 0;             ///< Samples drawn.
};

/// The best of up to `max_pose_attempts` similarities through `pose_sample_size` of the `matches`;
/// none with fewer than `min_pose_associations`. Not refined on its associations. `local_m`: frame
/// of the keyframe's base; `map_m`: frame `map`. O(attempts * local * map).
std::optional<PoseEstimate> estimate_pose(std::span<const Eigen::Vector2d> local_m,
                                          std::span<const Eigen::Vector2d> map_m,
                                          std::span<const hierarchy::baseline::PointMatch> matches,
                                          const BaselineMapperParameters& parameters,
                                          std::mt19937& random);

}  // namespace understory::geoslam_mapper::baseline
