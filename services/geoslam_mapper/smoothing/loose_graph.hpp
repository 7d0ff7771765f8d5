// All that a graph measured, without a solver: to become part of another graph.
#pragma once

#include <map>
#include <vector>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The nodes of a graph and what was measured of them, in the graph's own frame.
struct LooseGraph {
  /// A node by its number.
  struct LooseNode {
    geometry::SE2 pose;
    Node node;             ///< Without observations and motions; `centre` means nothing.
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
  /// Of landmarks of a given map: what was given, in the frame of the map.
  std::map<model::LandmarkId, DormantObservation> given;
  /// With the gyro's bias as it is known in the end.
  std::vector<FrozenMotion> motions;
};

}  // namespace understory::geoslam_mapper::smoothing
