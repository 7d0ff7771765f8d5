// What the mapper's outputs need beyond the stage: differences between maps, the odometry frame,
// jumps of the pose.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/odometry.hpp"
#include "common/model/slam_output.hpp"

namespace understory::geoslam_mapper {

/// What leads from `before` to `after`, both in order of id. Landmarks that moved by less than
/// `moved_m` are left out; the ids of `update.merged` are merged, not removed.
model::MapDelta map_difference(const std::vector<model::MapLandmark>& before,
                               const std::vector<model::MapLandmark>& after,
                               const model::MapUpdate& update, double moved_m);

/// The same from those landmarks alone that are new or have moved; what is gone was merged. All in
/// order of id.
model::MapDelta map_change(const std::vector<model::MapLandmark>& before,
                           const std::vector<model::MapLandmark>& changed,
                           const model::MapUpdate& update, double moved_m);

/// `landmarks` as a holder has them after `delta`: in order of id.
std::vector<model::MapLandmark> with_delta(std::vector<model::MapLandmark> landmarks,
                                           const model::MapDelta& delta);

/// The sum of ODOMETRY, kept for the last stamps.
class OdometryFrame {
 public:
  void add(const model::Odometry& motion);
  /// At the newest stamp not after `utime`; identity before the first.
  geometry::SE2 odom_T_vehicle(model::Utime utime) const;

  std::string save() const;
  void load(const std::string& state);

 private:
  static constexpr std::size_t kKept = 4000;
  struct Pose {
    model::Utime utime = 0;
    geometry::SE2 odom_T_vehicle;
  };
  std::deque<Pose> poses_;
};

/// One pose for each scan of a localised keyframe, in order of time; for one that was not localised
/// a single one with its status, at the last scan. Frame map is the submap.
std::vector<model::SlamPose> poses_of(const model::Keyframe& keyframe,
                                      const model::MapUpdate& update);

/// Notices jumps of the base poses against what the keyframer tracked.
class JumpWatch {
 public:
  JumpWatch(double distance_m = 0.5, double angle_rad = 0.05)
      : distance_m_(distance_m), angle_rad_(angle_rad) {}
  void add(const model::Keyframe& keyframe, const model::MapUpdate& update);
  std::uint64_t count() const { return count_; }
  const geometry::SE2& delta() const { return delta_; }

  std::string save() const;
  void load(const std::string& state);

 private:
  double distance_m_;
  double angle_rad_;
  std::optional<geometry::SE2>
      predicted_;  // map_T_base that tracking leads to; none before the first
  std::uint64_t count_ = 0;
  geometry::SE2 delta_;
};

}  // namespace understory::geoslam_mapper
