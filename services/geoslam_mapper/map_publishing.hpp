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

namespace understory {

/// What leads from `before` to `after`, both in order of id. Landmarks that moved by less than
/// `moved_m` are left out; the ids of `update.merged` are merged, not removed.
MapDelta map_difference(const std::vector<MapLandmark>& before,
                        const std::vector<MapLandmark>& after, const MapUpdate& update,
                        double moved_m);

/// The same from those landmarks alone that are new or have moved; what is gone was merged. All in
/// order of id.
MapDelta map_change(const std::vector<MapLandmark>& before, const std::vector<MapLandmark>& changed,
                    const MapUpdate& update, double moved_m);

/// `landmarks` as a holder has them after `delta`: in order of id.
std::vector<MapLandmark> with_delta(std::vector<MapLandmark> landmarks, const MapDelta& delta);

/// The sum of ODOMETRY, kept for the last stamps.
class OdometryFrame {
 public:
  void add(const Odometry& motion);
  /// At the newest stamp not after `utime`; identity before the first.
  SE2 odom_T_vehicle(Utime utime) const;

  std::string save() const;
  void load(const std::string& state);

 private:
  static constexpr std::size_t kKept = 4000;
  struct Pose {
    Utime utime = 0;
    SE2 odom_T_vehicle;
  };
  std::deque<Pose> poses_;
};

/// One pose for each scan of a localised keyframe, in order of time; for one that was not localised
/// a single one with its status, at the last scan. Frame map is the submap.
std::vector<SlamPose> poses_of(const Keyframe& keyframe, const MapUpdate& update);

/// Notices jumps of the base poses against what the keyframer tracked.
class JumpWatch {
 public:
  JumpWatch(double distance_m = 0.5, double angle_rad = 0.05)
      : distance_m_(distance_m), angle_rad_(angle_rad) {}
  void add(const Keyframe& keyframe, const MapUpdate& update);
  std::uint64_t count() const { return count_; }
  const SE2& delta() const { return delta_; }

  std::string save() const;
  void load(const std::string& state);

 private:
  double distance_m_;
  double angle_rad_;
  std::optional<SE2> predicted_;  // map_T_base that tracking leads to; none before the first
  std::uint64_t count_ = 0;
  SE2 delta_;
};

}  // namespace understory
