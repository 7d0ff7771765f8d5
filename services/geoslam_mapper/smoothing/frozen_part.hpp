// A part of the graph that is solved separately.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "common/factor_graph/plane/smoother.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A motion between two nodes, at least one of which is frozen.
struct FrozenMotion {
  NodeIndex a = 0;
  NodeIndex b = 0;
  geometry::SE2 a_T_b;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  /// Number of stored submaps whose landmarks it represents; 0: a measured motion.
  std::uint32_t away = 0;
  std::uint64_t closure = 0;  ///< Its id; 0: no closure.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.a, s.b, s.a_T_b, s.information, s.away, s.closure);
  }
};

/// Condensed measurement among nodes, made of frozen nodes.
struct FrozenFactor {
  std::vector<NodeIndex> nodes;                  ///< The first is the frame of the others.
  factor_graph::plane::CondensedPoses measured;  ///< Its `poses` are not used.
};

/// Connected nodes to be frozen, and the nodes around that they are tied to.
struct FrozenPart {
  std::vector<NodeIndex> inner;
  std::vector<NodeIndex> outer;  ///< The origin of the map last.
  std::vector<FrozenMotion> motions;
  std::vector<FrozenFactor> factors;  ///< Of nodes that were frozen earlier.
};

/// The connected parts of the nodes to be frozen, with the motions and earlier factors that touch
/// them; others are skipped. O(n log n).
std::vector<FrozenPart> parts_of(std::span<const FrozenMotion> motions,
                                 std::span<const FrozenFactor> factors,
                                 const std::set<NodeIndex>& nodes);

/// Pose of a node.
using PoseOf = std::function<geometry::SE2(NodeIndex)>;

/// Condensed measurement of a part's outer nodes: the part is optimised alone, and the result is
/// the joint marginal of the outer nodes in the frame of the first (thesis on submaps §2.3.3,
/// §3.4.2, with a node of the solved graph as origin). `pose_of` gives the initial poses. None if
/// there is one outer node, or if the motions leave an inner node undetermined. Exact for Gaussian
/// noise, except for the linearisation at the part's own optimum. Cost: one factorisation of the
/// part.
std::optional<FrozenFactor> condensed(const FrozenPart& part, const PoseOf& pose_of);

}  // namespace understory::geoslam_mapper::smoothing
