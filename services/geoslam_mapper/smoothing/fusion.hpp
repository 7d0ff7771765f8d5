// What a placed keyframe adds to the graph.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/motion.hpp"
#include "services/geoslam_mapper/smoothing/placement.hpp"

namespace understory::geoslam_mapper::smoothing {

/// What became of a keyframe in the graph.
struct FusedKeyframe {
  bool ok = false;
  std::string reason;  ///< Why it was taken back.
  NodeIndex node = 0;
  bool is_new_node = false;                      ///< Not one that was there before.
  model::Keyframe keyframe;                      ///< In the frame of `node`.
  std::vector<model::Association> associations;  ///< Without those that do not fit.
  double chi2 = 0.0;                             ///< Of the associations that fit.
  std::uint32_t degrees_of_freedom = 0;          ///< Of `chi2`.
  bool is_determined = true;                     ///< The measurements determine all variables.
  /// The stretch was to become one node, whether it did or not.
  bool took_stretch = false;
  std::vector<Retirement> condensed;  ///< The nodes of the stretch, where they became one.
};

/// Adds the keyframe to the graph, or folds it into the node of the same viewpoint, and solves.
/// Single associations that do not fit are taken out. If the rest contradicts the map, the graph is
/// rolled back exactly and the result is not `ok`. Otherwise the keyframe is in the trajectory, and
/// the map has its estimates and counts. Cost: what the keyframe observes and moves.
///
/// `stretch`: nodes that become one in the same solution, far behind the keyframe's; none where it
/// is empty. They wait where the keyframe is refused or belongs to one of them, and stay as they
/// are where one node cannot stand for them.
FusedKeyframe fuse(const model::Keyframe& keyframe, const Placement& placement,
                   const Motion& motion, const SmoothingMapperParameters& parameters,
                   std::span<const NodeIndex> stretch, GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
