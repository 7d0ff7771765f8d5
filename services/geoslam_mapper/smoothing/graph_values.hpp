// What the pose graph is given and what it gives back, as values.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "common/factor_graph/plane/archive.hpp"
#include "common/geometry/se2.hpp"
#include "services/geoslam_mapper/smoothing/frozen_motions.hpp"
#include "services/geoslam_mapper/smoothing/node.hpp"

namespace understory::geoslam_mapper::smoothing {

/// So many landmarks that both observed hold a node to another one without a motion between them.
inline constexpr std::size_t kHold = 3;

/// An observation that became another landmark's, as it was.
struct HandedOver {
  NodeIndex node = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();   ///< In the node's frame.
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< [1/m^2]
  bool counts = true;  ///< False: the node observed both, and keeps the other observation alone.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.position_m, s.information, s.counts);
  }
};

/// What a node observed of a landmark that is not in the solved graph.
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

/// Landmarks that are kept elsewhere, and what stands for them in the graph.
struct AwayLandmarks {
  std::vector<std::vector<DormantObservation>> observed;  ///< In the order of the ids.
  std::vector<FrozenMotion> ties;                         ///< Of each two nodes, one.
};

/// A node that holds the solved graph.
struct Anchor {
  NodeIndex node = 0;
  geometry::SE2 map_T_node;  ///< As it was when it began to hold the graph.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.map_T_node);
  }
};

/// A node to be taken out, and the node that gets what it observed.
struct Retirement {
  NodeIndex node = 0;
  NodeIndex into = 0;
  geometry::SE2WithCovariance into_T_node;
};

/// What adds nothing to the map any more.
struct Surplus {
  std::vector<Retirement> nodes;
  /// Nodes that stay for what they observed; the motions to them go.
  std::vector<NodeIndex> loose;
  /// Pairs of nodes that stay; the motions between them go.
  std::vector<std::pair<NodeIndex, NodeIndex>> motions;
};

}  // namespace understory::geoslam_mapper::smoothing
