// Fuses two overlapping maps.
#pragma once

#include <utility>
#include <vector>

#include "common/map_file/stored_map.hpp"
#include "common/map_merge/alignment.hpp"

namespace understory::map_merge {

/// Result of a fusion.
struct MergedMaps {
  /// The first map's number, name, frame, trajectory, borders and closures; the landmarks of both.
  map_file::StoredMap map;
  /// The second map's number, name, trajectory, borders and closures in the first one's frame; no
  /// landmarks.
  map_file::StoredMap trajectory;
  /// For each landmark of the second map: its id there and its id in `map`; sorted by the former.
  std::vector<std::pair<model::LandmarkId, model::LandmarkId>> renamed;
  std::size_t fused = 0;  ///< Landmarks of both maps.
  std::size_t added = 0;  ///< Landmarks of the second map alone.
  /// Added landmarks nearer than `suspicious_m` to one of the first map: possible doubles.
  std::size_t suspected_doubles = 0;
};

/// Parameters of the fusion.
struct FusionParameters {
  double unknown_sigma_m = 0.1;  ///< Sigma of a landmark without covariance, per axis [m].
  double suspicious_m = 0.3;     ///< See MergedMaps::suspected_doubles.
};

/// Fuses the pairs of `alignment` and adds the rest of the second map. A fused landmark keeps the
/// first map's id, has both positions weighted by information, the sum of the counts, the radius
/// weighted by counts, and the existence of the younger map. States of existence follow their
/// landmarks; of a pair the state with the later stamp is used, with its probability; learned
/// values are those of the later stamp. The common part of the covariances (1 -
/// `LandmarkPair::independent_share`) is not reduced. Ids of added landmarks continue after the
/// first map's last. Precondition: the alignment was found for these landmarks in this order; the
/// maps' numbers differ.
MergedMaps fuse(const map_file::StoredMap& first, const map_file::StoredMap& second,
                const Alignment& alignment, const FusionParameters& parameters = {});

/// The landmarks of a stored map as input of align().
std::vector<model::MapLandmark> landmarks_of(const map_file::StoredMap& map);

}  // namespace understory::map_merge
