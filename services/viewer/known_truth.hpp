// Ground truth relative to the map: the true pose, the true path, the errors of poses.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "common/model/slam_output.hpp"
#include "services/viewer/part.hpp"
#include "services/viewer/track.hpp"
#include "services/viewer/truth_alignment.hpp"

namespace understory::viewer {

/// Difference between a pose and the truth at its time.
struct TruthError {
  double error_m = 0.0;
  double error_rad = 0.0;
  std::optional<double> nees;  ///< None if the covariance is singular.
  /// Aligned by the keyframe that began the map. The best fit of all poses is no truth: it contains
  /// the pose's own error.
  bool is_tied = false;
};

/// The truth in the frame of the map. Aligned by the keyframe that began the map, whose pose
/// defines its frame; if that is unknown, by the alignment of all poses.
class KnownTruth {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit KnownTruth(Change& changes) : changes_(&changes), track_(changes) {}

  /// A true pose, in order of time.
  void take(model::Utime utime, const geometry::SE2& world_T_vehicle);
  /// Another map begins, in an unknown frame.
  void start_map();
  /// The keyframe that began the map.
  void tie(const model::MapUpdate& first);
  /// Compares a pose in the map: sets the true pose and draws the true path. None if the truth at
  /// that time, or the map's frame, is unknown.
  std::optional<TruthError> compare(const model::SlamPose& pose);
  /// Removes the truth.
  void clear() { world_truth_.clear(); }

  /// The true path, frame map.
  const Track& track() const { return track_; }
  /// The true pose at the time of the newest pose, frame map.
  const Part<std::optional<geometry::SE2>>& pose() const { return pose_; }

 private:
  std::optional<geometry::SE2> at(model::Utime utime) const;
  void draw(const geometry::SE2& world_T_map, const geometry::SE2& map_T_vehicle);
  void draw_whole(const geometry::SE2& world_T_map);
  void draw_newest(const geometry::SE2& world_T_map);

  Change* changes_;
  std::vector<std::pair<model::Utime, geometry::SE2>> world_truth_;
  std::optional<geometry::SE2> world_T_map_;
  TruthAlignment alignment_;
  geometry::SE2 drawn_world_T_map_;
  Track track_;
  Part<std::optional<geometry::SE2>> pose_;
};

}  // namespace understory::viewer
