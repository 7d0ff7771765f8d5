// Adds a placed keyframe to the graph.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/motion.hpp"
#include "services/geoslam_mapper/smoothing/placement.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Result of fusing a keyframe.
struct FusedKeyframe {
  bool ok = false;
  std::string reason;  ///< Why it was rolled back.
  NodeIndex node = 0;
  bool is_new_node = false;                      ///< False: an existing node.
  model::Keyframe keyframe;                      ///< In the frame of `node`.
  std::vector<model::Association> associations;  ///< Those that fit.
  double chi2 = 0.0;                             ///< Of the associations that fit.
  std::uint32_t degrees_of_freedom = 0;          ///< Of `chi2`.
  bool is_determined = true;                     ///< The measurements determine all variables.
  /// This call was to condense the stretch, whether it succeeded or not.
  bool took_stretch = false;
  std::vector<Retirement> condensed;  ///< The nodes of the stretch, if they were condensed.
};

/// Adds the keyframe to the graph, or folds it into the node of the same viewpoint, and solves.
/// Single associations that do not fit are removed. If the rest contradicts the map, the graph is
/// rolled back exactly and the result is not `ok`. Otherwise the keyframe is in the trajectory, and
/// the map has the new estimates and counts. Cost: the observed and the moved variables.
///
/// `stretch`: nodes to condense into one in the same solution, far behind the keyframe's; may be
/// empty. Condensing waits if the keyframe is refused or belongs to one of them; the nodes stay if
/// one node cannot replace them.
FusedKeyframe fuse(const model::Keyframe& keyframe, const Placement& placement,
                   const Motion& motion, const SmoothingMapperParameters& parameters,
                   std::span<const NodeIndex> stretch, GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
