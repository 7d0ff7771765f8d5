// Matches the landmarks of one pass to those of another one.
#pragma once

#include <vector>

#include "common/geometry/registration.hpp"
#include "services/geoslam_mapper/smoothing/earlier_pass.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Landmarks of one pass around a node; the vectors have the same order.
struct PassLandmarks {
  std::vector<model::LandmarkId> ids;
  std::vector<geometry::UncertainPoint> points;
};

/// The landmarks around a node, of its own pass and of another one.
struct Scene {
  PassLandmarks ours;    ///< In the frame of the node.
  PassLandmarks theirs;  ///< In the map.
  double reach_m = 0.0;  ///< Radius around the node within which theirs were collected.
  geometry::SE2WithCovariance map_T_node;  ///< Predicted by the graph, relative to the other pass.
  double sigma_m = 0.0;                    ///< Of its position, larger axis.
};

/// Fewest landmarks of either pass, and fewest pairs.
inline constexpr std::size_t kFewestOfPass = 2;

/// The landmarks around `node` that its pass and another one observed. O(landmarks within reach).
Scene scene_around(const model::FieldOfView& field_of_view, NodeIndex node, const EarlierPass& pass,
                   const GlobalMap& map);

/// Pairs that are the same landmark, in the order of Merges::in_order(); none if the match may be a
/// chance or another pose is as likely. With few landmarks all pairs of pairs are tested; else
/// gates are used if they are narrower than the distance of landmarks, else the constellation. Only
/// pairs that fit well are returned: the others are judged singly when the passes are joined.
std::vector<MergedPair> match_passes(const Scene& scene,
                                     const SmoothingMapperParameters& parameters,
                                     const GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
