// Additions to the mapper's poses: a pose for each scan, the odometry frame, jumps.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/odometry.hpp"
#include "common/model/slam_output.hpp"

namespace understory::geoslam_mapper {

/// The sum of ODOMETRY: frame `odom`, kept for the last 4000 stamps.
class OdometryFrame {
 public:
  /// Adds an increment, in order of time.
  void add(const model::Odometry& motion);
  /// Pose at the newest stamp not after `utime`; before the oldest stamp kept, the oldest pose;
  /// identity before the first.
  geometry::SE2 odom_T_vehicle(model::Utime utime) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.poses_);
  }

 private:
  static constexpr std::size_t kKept = 4000;
  struct Pose {
    model::Utime utime = 0;
    geometry::SE2 odom_T_vehicle;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.utime, s.odom_T_vehicle);
    }
  };
  std::deque<Pose> poses_;
};

/// One pose for each scan of a localised keyframe, in order of time. For a keyframe that was not
/// localised a single one with its status, at the last scan. The map's frame is that of the submap.
std::vector<model::SlamPose> poses_of(const model::Keyframe& keyframe,
                                      const model::MapUpdate& update);

/// Sets the landmark ids of the keyframe's detections, if it was localised.
void identify_detections(const model::Keyframe& keyframe, model::MapUpdate& update);

/// First numbers of a mapper whose saved state is lost.
struct NumbersAfterLoss {
  std::uint32_t map_id =
      0;  ///< 1000 to 30,999: earlier maps count from 1, and 32767 is the largest.
  std::uint64_t resets = 0;  ///< First value of `reset_counter`.
};
/// Numbers that no earlier map and no earlier jump had, since other processes may still use them.
/// `written_s`: time at which the lost state was written [s since 1970]; a drive has fewer maps and
/// jumps than seconds.
NumbersAfterLoss numbers_after_loss(std::int64_t written_s);

/// Detects jumps of the keyframes' poses against the keyframer's tracking, and changes of the map.
class JumpWatch {
 public:
  /// A pose that differs from the tracked one by more than `distance_m` or `angle_rad` is a jump.
  explicit JumpWatch(double distance_m = 0.5, double angle_rad = 0.05)
      : distance_m_(distance_m), angle_rad_(angle_rad) {}

  /// Adds the next keyframe and its result.
  void add(const model::Keyframe& keyframe, const model::MapUpdate& update);
  /// Continues counting after the `count` jumps of a process whose state is lost.
  void begin_behind(std::uint64_t count) { count_ = count; }
  /// Number of jumps so far.
  std::uint64_t count() const { return count_; }
  /// The last jump: tracked_T_new of the vehicle; identity after a change of the map, where the
  /// motion between the frames is unknown.
  const geometry::SE2& delta() const { return delta_; }

  /// Members of a saved state; see common/state. The limits are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.predicted_, self.count_, self.delta_, self.map_id_);
  }

 private:
  void begin_map(std::uint32_t map_id);

  double distance_m_;
  double angle_rad_;
  /// map_T_base by tracking; none before the first keyframe, and after an interruption of tracking.
  std::optional<geometry::SE2> predicted_;
  std::uint64_t count_ = 0;
  geometry::SE2 delta_;
  std::uint32_t map_id_ = 0;  ///< Of the last keyframe; 0 before the first.
};

}  // namespace understory::geoslam_mapper
