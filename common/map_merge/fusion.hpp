// Two maps that overlap as one.
#pragma once

#include <utility>
#include <vector>

#include "common/map_file/stored_map.hpp"
#include "common/map_merge/alignment.hpp"

namespace understory::map_merge {

/// What two maps became.
struct MergedMaps {
  /// The first map's number, name, frame, trajectory, borders and closures; the landmarks of both.
  map_file::StoredMap map;
  /// The second map's number, name, trajectory, borders and closures in the first one's frame; no
  /// landmarks.
  map_file::StoredMap trajectory;
  /// What each landmark of the second map became: its id there, its id in `map`; by the former.
  std::vector<std::pair<model::LandmarkId, model::LandmarkId>> renamed;
  std::size_t fused = 0;  ///< Landmarks that both had.
  std::size_t added = 0;  ///< Landmarks of the second map alone.
  /// Landmarks that were added nearer to one of the first map's than `suspicious_m`: doubles?
  std::size_t suspected_doubles = 0;
};

/// How to fuse.
struct FusionParameters {
  double unknown_sigma_m = 0.1;  ///< Of a landmark without covariance, per axis [m].
  double suspicious_m = 0.3;     ///< See MergedMaps::suspected_doubles.
};

/// Fuses what `alignment` has in pairs and adds the rest of the second map. A fused landmark keeps
/// the first map's id and has both positions by their information, the counts of both, the radius
/// by them, the existence that the younger map states. States of existence follow their landmarks;
/// of a pair the one with the later stamp stays, and its probability is the landmark's; what was
/// learned for all is that of the later stamp. What of the covariances is common to all
/// landmarks (`LandmarkPair::independent_share`) is not made smaller. Ids of added ones go on
/// behind the first map's last. Precondition: the alignment is of these landmarks, in this order,
/// and found; the maps' numbers differ.
MergedMaps fuse(const map_file::StoredMap& first, const map_file::StoredMap& second,
                const Alignment& alignment, const FusionParameters& parameters = {});

/// The landmarks of a stored map as align() takes them.
std::vector<model::MapLandmark> landmarks_of(const map_file::StoredMap& map);

}  // namespace understory::map_merge
