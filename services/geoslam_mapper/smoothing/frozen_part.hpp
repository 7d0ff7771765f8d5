// A part of the graph that is solved by itself.
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
  /// It stands for landmarks of so many submaps that are kept elsewhere; 0: a motion of the nodes.
  std::uint32_t away = 0;
  std::uint64_t closure = 0;  ///< Its number; 0: none.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.a, s.b, s.a_T_b, s.information, s.away, s.closure);
  }
};

/// What frozen nodes measure of others.
struct FrozenFactor {
  std::vector<NodeIndex> nodes;  ///< The first is the one in whose frame the others are.
  factor_graph::plane::CondensedPoses measured;  ///< Its `poses` mean nothing.
};

/// Nodes to be frozen that hang together, and the nodes that they are tied to.
struct FrozenPart {
  std::vector<NodeIndex> inner;
  std::vector<NodeIndex> outer;  ///< The origin of the map last.
  std::vector<FrozenMotion> motions;
  std::vector<FrozenFactor> factors;  ///< Of nodes that were frozen before.
};

/// The parts that motions and earlier parts make of nodes to be frozen; those that touch none are
/// passed over. O(n log n).
std::vector<FrozenPart> parts_of(std::span<const FrozenMotion> motions,
                                 std::span<const FrozenFactor> factors,
                                 const std::set<NodeIndex>& nodes);

/// Pose of a node.
using PoseOf = std::function<geometry::SE2(NodeIndex)>;

/// What a part measures of its outer nodes: it is optimised on its own, and the outer nodes have
/// their joint marginal in the frame of the first (thesis on submaps §2.3.3, §3.4.2, with a node of
/// the solved graph as origin). `pose_of` gives where to start. None where there is one outer node,
/// or where the motions leave an inner node undetermined. Exact for Gaussian noise but for the
/// linearisation at the part's own optimum. Cost: one factorisation of the part.
std::optional<FrozenFactor> condensed(const FrozenPart& part, const PoseOf& pose_of);

}  // namespace understory::geoslam_mapper::smoothing
