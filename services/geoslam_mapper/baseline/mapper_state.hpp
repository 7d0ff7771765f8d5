// Everything that the source's mapper remembers, and its bytes.
#pragma once

#include <string>
#include <vector>

#include "common/hierarchy/baseline/hierarchy.hpp"
#include "common/model/map.hpp"
#include "services/geoslam_mapper/baseline/discovery.hpp"
#include "services/geoslam_mapper/baseline/graph.hpp"

namespace understory::geoslam_mapper::baseline {

/// What the graph does not say about a landmark of the map.
struct LandmarkRecord {
  model::LandmarkId id = 0;
  double radius_m = 0.0;
  std::uint32_t observation_count = 0;  ///< 0: given at the start and not seen yet.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
};

struct PoseRecord {
  std::uint64_t keyframe_sequence = 0;
  model::Utime utime = 0;
};

/// What a keyframe may change before it is accepted: a copy of it is the way back.
struct MapContents {
  Graph graph;
  std::vector<LandmarkRecord> landmarks;  ///< As many as graph.landmarks_m.
  std::vector<PoseRecord> poses;          ///< As many as graph.poses.
  model::LandmarkId last_id = 0;
  DiscoveryNetwork network;
};

struct MapperState {
  MapContents map;
  hierarchy::baseline::Hierarchy hierarchy;  ///< Of map.graph.landmarks_m.
  /// Where the landmarks were when `hierarchy` was built: its descriptors are of then.
  std::vector<Eigen::Vector2d> hierarchy_points_m;
};

/// CBOR. The hierarchy is not stored: load makes it again from hierarchy_points_m.
std::string save(const MapperState& state);
/// Throws std::invalid_argument on bytes that save() did not make.
MapperState load_mapper_state(const std::string& bytes, double descriptor_step);

}  // namespace understory::geoslam_mapper::baseline
