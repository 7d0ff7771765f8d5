// What the payload of a submap holds.
#pragma once

#include <string>
#include <vector>

#include "services/geoslam_mapper/smoothing/frozen_part.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"
#include "services/geoslam_mapper/smoothing/trajectory.hpp"

namespace understory::geoslam_mapper::smoothing {

/// All that is needed to put a submap back, and to optimise stored submaps without the mapper.
struct SubmapContent {
  NodeIndex node = 0;  ///< The submap's frame is this node of the graph.
  std::vector<StoredLandmark> landmarks;
  /// Of each landmark what nodes observed of it, those of other submaps among them.
  std::vector<std::vector<DormantObservation>> observed;
  AwayBases bases;
  /// How the node lay to others when the submap was handed over, closures among them; with the
  /// gyro's bias as it was known then. None in submaps of 0.2.0.
  std::vector<FrozenMotion> motions;
  /// What stood for the landmarks in the mapper's graph while they were away. None in submaps of
  /// before 0.4.0.
  std::vector<FrozenMotion> ties;
};

/// As bytes.
std::string submap_payload(const SubmapContent& content);
/// Back, also from those of 0.2.0. Throws std::invalid_argument where the bytes are none.
SubmapContent submap_content(const std::string& payload);

}  // namespace understory::geoslam_mapper::smoothing
