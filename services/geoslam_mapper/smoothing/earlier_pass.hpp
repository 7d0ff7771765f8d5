// Other passes beside a node that its own one is not tied to yet.
#pragma once

#include <optional>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Another pass near by, and where it is to the node that was asked for, by the graph.
struct EarlierPass {
  std::optional<NodeIndex> node;  ///< None: a given map that no node saw; its frame instead.
  geometry::SE2WithCovariance node_T_asked;  ///< Without a node map_T_asked.
  double sigma_m = 0.0;                      ///< Of that position, larger axis.
  bool is_given = false;                     ///< A map that came from elsewhere and has no path.
};

/// What was seen last so long ago on the way [m] is of an earlier pass.
inline constexpr double kAnotherPass_m = 50.0;
/// Sigmas of the distance of two passes within which they are looked for, and the furthest [m].
inline constexpr double kReachOfPasses_sigmas = 4.0;
inline constexpr double kFurthestPass_m = 300.0;

/// The passes that are near where a node seems to be and whose distance is not known yet to
/// 0.1 m, nearest first, and the map that was given there. Of each pass the nearest node is asked,
/// of four passes at most. O(nodes within reach) and one relative covariance for each pass.
std::vector<EarlierPass> find_earlier_passes(const model::FieldOfView& field_of_view, NodeIndex at,
                                             const GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
