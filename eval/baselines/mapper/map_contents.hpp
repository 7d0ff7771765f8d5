// The map of the thesis's mapper.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/map.hpp"
#include "eval/baselines/mapper/discovery.hpp"
#include "eval/baselines/mapper/graph.hpp"

namespace understory::eval::baselines::mapper {

/// What the graph does not hold of a landmark.
struct LandmarkRecord {
  model::LandmarkId id = 0;
  double radius_m = 0.0;
  std::uint32_t observation_count = 0;  ///< 0: given at the start and not observed yet.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;

  /// All of it.
  bool operator==(const LandmarkRecord&) const = default;
};

/// What the graph does not hold of a pose.
struct PoseRecord {
  std::uint64_t keyframe_sequence = 0;
  model::Utime utime = 0;

  /// All of it.
  bool operator==(const PoseRecord&) const = default;
};

/// What a keyframe may change before it is accepted; a copy of it is the rollback.
struct MapContents {
  Graph graph;
  std::vector<LandmarkRecord> landmarks;  ///< As many as graph.landmarks_m.
  std::vector<PoseRecord> poses;          ///< As many as graph.poses.
  model::LandmarkId last_id = 0;          ///< The last id that was given.
  DiscoveryNetwork network;

  /// All of it.
  bool operator==(const MapContents&) const = default;
};

}  // namespace understory::eval::baselines::mapper
