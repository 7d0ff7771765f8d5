// Input and output values of the pose graph.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "common/factor_graph/plane/archive.hpp"
#include "common/geometry/se2.hpp"
#include "services/geoslam_mapper/smoothing/frozen_motions.hpp"
#include "services/geoslam_mapper/smoothing/node.hpp"

namespace understory::geoslam_mapper::smoothing {

/// This number of common landmarks ties two nodes without a motion between them.
inline constexpr std::size_t kHold = 3;

/// An observation that was handed over to another landmark, in its original form.
struct HandedOver {
  NodeIndex node = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();   ///< In the node's frame.
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< [1/m^2]
  bool counts =
      true;  ///< False: the node observed both landmarks and keeps only the other observation.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.position_m, s.information, s.counts);
  }
};

/// A node's observation of a landmark outside the solved graph.
struct DormantObservation {
  NodeIndex node = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();   ///< In the node's frame.
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< [1/m^2]

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.position_m, s.information);
  }
};

/// Landmarks that are stored elsewhere, and the motions that replace them in the graph.
struct AwayLandmarks {
  std::vector<std::vector<DormantObservation>> observed;  ///< In the order of the ids.
  std::vector<FrozenMotion> ties;                         ///< One per pair of nodes.
};

/// A node that holds the solved graph fixed.
struct Anchor {
  NodeIndex node = 0;
  geometry::SE2 map_T_node;  ///< When it began to hold the graph.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.map_T_node);
  }
};

/// A node to remove, and the node that receives its observations.
struct Retirement {
  NodeIndex node = 0;
  NodeIndex into = 0;
  geometry::SE2WithCovariance into_T_node;
};

/// Parts of the graph that add no information to the map.
struct Surplus {
  std::vector<Retirement> nodes;
  /// Nodes that keep their observations but lose their motions.
  std::vector<NodeIndex> loose;
  /// Pairs of nodes that stay but lose the motions between them.
  std::vector<std::pair<NodeIndex, NodeIndex>> motions;
};

}  // namespace understory::geoslam_mapper::smoothing
