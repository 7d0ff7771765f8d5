// The map as one value: landmarks, graph, trajectory.
#pragma once

#include "services/geoslam_mapper/smoothing/landmark_map.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"
#include "services/geoslam_mapper/smoothing/trajectory.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The global map (GeoSLAM §4.3). Each part owns its state; this is their bundle.
struct GlobalMap {
  LandmarkMap landmarks;
  PoseGraph graph;
  Trajectory trajectory;

  /// An empty map.
  explicit GlobalMap(const SmoothingMapperParameters& parameters)
      : graph(parameters), trajectory(parameters) {}

  /// Whether there is neither a landmark nor a keyframe.
  bool empty() const { return landmarks.empty() && trajectory.bases().empty(); }

  /// Takes over what the graph's updates moved since its checkpoint. Costs what moved.
  void adopt_estimates() {
    for (const auto& [id, position_m] : graph.moved_landmarks()) landmarks.move(id, position_m);
    trajectory.follow(graph);
  }

  /// A landmark as other processes get it, at the present estimate.
  model::MapLandmark landmark(const StoredLandmark& stored) const {
    model::MapLandmark out;
    out.id = stored.id;
    out.position_m = graph.position(stored.id).value_or(stored.position_m);
    out.radius_m = stored.radius_m;
    out.observation_count = stored.observation_count;
    out.kind = stored.kind;
    return out;
  }

  /// Members of a saved state; see common/state. After a load the graph is solved from its saved
  /// estimates, and all landmarks are reported as changed.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.landmarks, self.graph, self.trajectory);
    if constexpr (Archive::kReads) self.resume();
  }

 private:
  void resume() {
    trajectory.rebuild_index(graph);
    if (!trajectory.bases().empty()) graph.solve();
    landmarks.mark_all_changed();
  }
};

}  // namespace understory::geoslam_mapper::smoothing
