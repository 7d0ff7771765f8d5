// Everything that the baseline mapper remembers, and its bytes.
#pragma once

#include <string>
#include <vector>

#include "common/hierarchy/baseline/hierarchy.hpp"
#include "common/model/map.hpp"
#include "services/geoslam_mapper/baseline/discovery.hpp"
#include "services/geoslam_mapper/baseline/graph.hpp"

namespace understory::geoslam_mapper::baseline {

/// What the graph does not hold of a landmark.
struct LandmarkRecord {
  model::LandmarkId id = 0;
  double radius_m = 0.0;
  std::uint32_t observation_count = 0;  ///< 0: given at the start and not observed yet.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.radius_m, s.observation_count, s.kind);
  }
};

/// What the graph does not hold of a pose.
struct PoseRecord {
  std::uint64_t keyframe_sequence = 0;
  model::Utime utime = 0;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.keyframe_sequence, s.utime);
  }
};

/// What a keyframe may change before it is accepted; a copy of it is the rollback.
struct MapContents {
  Graph graph;
  std::vector<LandmarkRecord> landmarks;  ///< As many as graph.landmarks_m.
  std::vector<PoseRecord> poses;          ///< As many as graph.poses.
  model::LandmarkId last_id = 0;          ///< The last id that was given.
  DiscoveryNetwork network;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.graph, s.landmarks, s.poses, s.last_id, s.network);
  }
};

/// The whole state.
struct MapperState {
  MapContents map;
  hierarchy::baseline::Hierarchy hierarchy;  ///< Of map.graph.landmarks_m.
  /// Landmarks when `hierarchy` was built, frame `map`: its descriptors are of then.
  std::vector<Eigen::Vector2d> hierarchy_points_m;
};

/// The state as bytes. The hierarchy is not among them: load_mapper_state() makes it again from
/// hierarchy_points_m.
std::string save(const MapperState& state);
/// The state of what save() gave. `descriptor_step`: see BaselineMapperParameters. Throws
/// std::invalid_argument on other bytes.
MapperState load_mapper_state(const std::string& bytes, double descriptor_step);

}  // namespace understory::geoslam_mapper::baseline
