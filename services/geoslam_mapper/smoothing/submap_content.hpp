// The payload of a submap.
#pragma once

#include <string>
#include <vector>

#include "services/geoslam_mapper/smoothing/frozen_part.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"
#include "services/geoslam_mapper/smoothing/trajectory.hpp"

namespace understory::geoslam_mapper::smoothing {

/// All data needed to put a submap back, and to optimise stored submaps without the mapper.
struct SubmapContent {
  NodeIndex node = 0;  ///< The node of the graph that is the submap's frame.
  std::vector<StoredLandmark> landmarks;
  /// Observations of each landmark, including those by nodes of other submaps.
  std::vector<std::vector<DormantObservation>> observed;
  AwayBases bases;
  /// Motions to other nodes at the time of hand-over, including closures, with the gyro bias of
  /// that time. None in submaps of 0.2.0.
  std::vector<FrozenMotion> motions;
  /// Motions that replaced the landmarks in the mapper's graph while they were stored. None in
  /// submaps of before 0.4.0.
  std::vector<FrozenMotion> ties;
};

/// Encodes to bytes.
std::string submap_payload(const SubmapContent& content);
/// Decodes, also the format of 0.2.0. Throws std::invalid_argument on other bytes.
SubmapContent submap_content(const std::string& payload);

}  // namespace understory::geoslam_mapper::smoothing
