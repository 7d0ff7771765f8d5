// All measurements of a graph, without a solver, to be added to another graph.
#pragma once

#include <map>
#include <vector>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Nodes of a graph and their measurements, in the graph's own frame.
struct LooseGraph {
  /// A node by its number.
  struct LooseNode {
    geometry::SE2 pose;
    Node node;             ///< Without observations and motions; `centre` is not used.
    bool is_free = false;  ///< The number has no node.
  };
  /// A landmark of the solved graph.
  struct LooseLandmark {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    std::vector<DormantObservation> observed;
  };

  std::vector<LooseNode> nodes;
  std::map<model::LandmarkId, LooseLandmark> solved;
  std::map<model::LandmarkId, std::vector<DormantObservation>> dormant;
  /// Priors of landmarks of a given map, in the frame of the map.
  std::map<model::LandmarkId, DormantObservation> given;
  /// With the latest estimate of the gyro's bias.
  std::vector<FrozenMotion> motions;
};

}  // namespace understory::geoslam_mapper::smoothing
