// Which landmarks of one pass are which of another one.
#pragma once

#include <vector>

#include "common/geometry/registration.hpp"
#include "services/geoslam_mapper/smoothing/earlier_pass.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Landmarks of one pass around a node, index by index.
struct PassLandmarks {
  std::vector<model::LandmarkId> ids;
  std::vector<geometry::UncertainPoint> points;
};

/// The landmarks around a node: of the pass that it is of, and of another one.
struct Scene {
  PassLandmarks ours;                      ///< In the frame of the node.
  PassLandmarks theirs;                    ///< In the map.
  double reach_m = 0.0;                    ///< How far around the node theirs were taken.
  geometry::SE2WithCovariance map_T_node;  ///< As the graph expects it of the other pass.
  double sigma_m = 0.0;                    ///< Of its position, larger axis.
};

/// Fewest landmarks of either pass, and fewest pairs of them.
inline constexpr std::size_t kFewestOfPass = 2;

/// What `node`'s pass and another one saw around it. O(landmarks within reach).
Scene scene_around(const model::FieldOfView& field_of_view, NodeIndex node, const EarlierPass& pass,
                   const GlobalMap& map);

/// Pairs that are the same, in the order of Merges::in_order(); none where chance may have laid
/// them upon each other, or another place is as likely. By all pairs of pairs in a poor scene; else
/// by gates where these are narrower than the landmarks stand apart, or by constellation. Only
/// pairs that fit well: the others are judged one by one when the passes are joined.
std::vector<MergedPair> match_passes(const Scene& scene,
                                     const SmoothingMapperParameters& parameters,
                                     const GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
