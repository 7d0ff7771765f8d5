// Earlier passes near a node that are not tied to its own pass yet.
#pragma once

#include <optional>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Another pass near by, with its pose relative to the queried node in the graph.
struct EarlierPass {
  std::optional<NodeIndex>
      node;  ///< None: a given map that no node observed; then its frame is used.
  geometry::SE2WithCovariance node_T_asked;  ///< map_T_asked if there is no node.
  double sigma_m = 0.0;                      ///< Of that position, larger axis.
  bool is_given = false;                     ///< A given map without a path.
};

/// A landmark last seen more than this path length ago [m] belongs to an earlier pass.
inline constexpr double kAnotherPass_m = 50.0;
/// Search radius for passes, in sigmas of the distance of two passes, and the largest radius [m].
inline constexpr double kReachOfPasses_sigmas = 4.0;
inline constexpr double kFurthestPass_m = 300.0;

/// The passes near the estimated position of a node whose distance is not yet known to 0.1 m,
/// nearest first, and the given map there. Each pass is represented by its nearest node; at most
/// four passes. O(nodes within reach) and one relative covariance per pass.
std::vector<EarlierPass> find_earlier_passes(const model::FieldOfView& field_of_view, NodeIndex at,
                                             const GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
