// The thesis's global map (GeoSLAM §4.3, algorithms 3-5), as its published code has it.
#pragma once

#include <span>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "eval/baselines/mapper/map_contents.hpp"
#include "eval/baselines/mapper/parameters.hpp"
#include "eval/baselines/mapper/pose.hpp"

namespace understory::eval::baselines::mapper {

/// No odometry, no covariances, no removal or merging of landmarks. A value: a copy goes on as the
/// original would.
class Mapper {
 public:
  /// An empty map.
  explicit Mapper(const Parameters& parameters);

  /// Localises the keyframe and fuses it. The map changes only with the statuses kFirstMap and
  /// kUpdated; for the others `reason` states why.
  model::MapUpdate add(const model::Keyframe& keyframe);
  /// A map to start from (GeoSLAM §4.3.1), frame `map`; call it before the first keyframe.
  void start_with(std::span<const model::MapLandmark> landmarks);

  /// The pose of every keyframe's base, in order of time.
  std::vector<model::KeyframePose> trajectory() const;
  /// Every landmark of the map, in order of id.
  std::vector<model::MapLandmark> landmarks() const;
  /// What is known of the map, and what may become landmarks.
  const MapContents& map() const { return map_; }

 private:
  void start_map(const model::Keyframe& keyframe, model::MapUpdate& update);
  bool localise_and_fuse(const model::Keyframe& keyframe, model::MapUpdate& update);
  bool extend(const model::Keyframe& keyframe, const PoseEstimate& estimate,
              model::MapUpdate& update);
  bool fuse(const model::Keyframe& keyframe, const PoseEstimate& estimate,
            model::MapUpdate& update);
  void add_pose(const model::Keyframe& keyframe, const Eigen::Vector3d& pose);
  void add_landmark(const Eigen::Vector2d& position_m, LandmarkRecord record,
                    model::MapUpdate& update);
  void rebuild_hierarchy();

  Parameters parameters_;
  MapContents map_;
  hierarchy::Hierarchy
      hierarchy_;  ///< Of map_.graph.landmarks_m; descriptors of when it was built.
};

}  // namespace understory::eval::baselines::mapper
