// The map as one value: landmarks, graph, trajectory.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "services/geoslam_mapper/smoothing/landmark_map.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"
#include "services/geoslam_mapper/smoothing/trajectory.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The global map (GeoSLAM §4.3). Each part owns its state; this struct bundles them.
struct GlobalMap {
  LandmarkMap landmarks;
  PoseGraph graph;
  Trajectory trajectory;

  /// An empty map. `id`: upper 16 bit of its landmarks' ids.
  explicit GlobalMap(const SmoothingMapperParameters& parameters, std::uint32_t id = 1)
      : landmarks(id), graph(parameters), trajectory(parameters) {}

  /// Whether there is neither a landmark nor a keyframe.
  bool empty() const { return landmarks.empty() && trajectory.bases().empty(); }

  /// Copies the estimates that the graph's updates moved since its checkpoint into the landmarks;
  /// returns these. Cost: the moved landmarks.
  std::vector<model::LandmarkId> adopt_estimates() {
    std::vector<model::LandmarkId> moved;
    for (const auto& [id, position_m] : graph.take_moved_landmarks()) {
      landmarks.move(id, position_m);
      moved.push_back(id);
    }
    trajectory.follow(graph);
    return moved;
  }

  /// Moves dormant ones of these landmarks into the solved graph. Ends a checkpoint.
  void wake(std::span<const model::LandmarkId> ids) {
    if (std::ranges::none_of(ids, [&](auto id) { return graph.is_dormant(id); })) return;
    graph.checkpoint();
    wake_unsolved(ids);
    (void)graph.solve();  // Their information was in the graph already.
    adopt_estimates();
  }
  /// Likewise, without solving.
  void wake_unsolved(std::span<const model::LandmarkId> ids) {
    for (const model::LandmarkId id : ids)
      if (graph.is_dormant(id)) landmarks.move(id, graph.dormant_position(id));
    graph.wake(ids);
  }

  /// Adds a landmark of a given map to the graph, with its prior; does nothing if it is there
  /// already. The graph is not solved.
  void enter_given(model::LandmarkId id) {
    const StoredLandmark& landmark = landmarks.at(id);
    if (!graph.position(id)) graph.add_landmark(id, landmark.position_m, landmark.prior_covariance);
  }

  /// Moves all nodes into the solved graph, before a join that may move all of them. Ends a
  /// checkpoint.
  void unfreeze() {
    if (graph.frozen_count() == 0) return;
    graph.checkpoint();
    graph.unfreeze();
    (void)graph.solve();
    adopt_estimates();
  }

  /// A landmark at the present estimate, without covariance; see told_map.
  model::MapLandmark landmark(const StoredLandmark& stored) const {
    model::MapLandmark out;
    out.id = stored.id;
    out.position_m = graph.is_dormant(stored.id)
                         ? graph.dormant_position(stored.id)
                         : graph.position(stored.id).value_or(stored.position_m);
    out.radius_m = stored.radius_m;
    out.observation_count = stored.observation_count;
    out.kind = stored.kind;
    return out;
  }

  /// Every landmark likewise, in order of id. O(map).
  std::vector<model::MapLandmark> all_landmarks() const {
    std::vector<model::MapLandmark> result;
    result.reserve(landmarks.all().size());
    for (const auto& [id, stored] : landmarks.all()) result.push_back(landmark(stored));
    return result;
  }

  /// The pose of every base at the present estimate, without covariance, in order of time.
  /// O(bases).
  std::vector<model::KeyframePose> all_poses() const {
    std::vector<model::KeyframePose> result;
    result.reserve(trajectory.size());
    for (const Base& base : trajectory.bases()) {
      result.push_back(
          {base.sequence, base.utime, trajectory.pose(base, graph), Eigen::Matrix3d::Zero()});
    }
    return result;
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
