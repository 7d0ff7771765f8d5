// Poses of other processes' frames in the map, from poses of the same stamp.
#pragma once

#include <deque>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/slam_output.hpp"

namespace understory::foxglove {

/// Transform between frames `parent` and `child`, in the plane.
struct FrameLink {
  std::string_view parent;
  std::string_view child;
  geometry::SE2 parent_T_child;
};

/// The latest 64 poses by stamp.
class RecentPoses {
 public:
  /// Takes a pose; poses older than the newest are skipped.
  void add(model::Utime utime, const geometry::SE2& pose);
  /// The pose nearest to a stamp, within 10 ms; none where there is none.
  std::optional<geometry::SE2> at(model::Utime utime) const;

 private:
  static constexpr std::size_t kMost = 64;
  static constexpr model::Utime kTolerance_us = 10'000;
  std::deque<std::pair<model::Utime, geometry::SE2>> poses_;
};

/// For display alone. `ekf_map` is aligned with the map at every common stamp; `world`, the frame
/// of the ground truth, is aligned with a map once, at the first localised pose.
class FrameLinks {
 public:
  /// Takes the filter's pose.
  void take(const model::EkfPose& pose);
  /// Takes ground truth: world_T_vehicle.
  void take_truth(model::Utime utime, const geometry::SE2& world_T_vehicle);
  /// Takes the mapper's pose; call it after all earlier messages.
  void take(const model::SlamPose& pose);

  /// All known links: vehicle, odom, ekf_map, world, each in map. Empty before the first pose.
  std::vector<FrameLink> links() const;
  /// Stamp of the last pose.
  model::Utime utime() const { return pose_ ? pose_->utime : 0; }
  /// True pose of the vehicle at the last pose's stamp, in the map; none where it is unknown.
  std::optional<geometry::SE2> true_pose() const;

 private:
  RecentPoses filter_;  ///< ekf_map_T_vehicle.
  RecentPoses truth_;   ///< world_T_vehicle.
  std::optional<model::SlamPose> pose_;
  std::optional<geometry::SE2> map_T_ekf_map_;
  std::optional<geometry::SE2> map_T_world_;
};

/// Whether the pose in the map is valid.
bool is_usable(const model::SlamPose& pose);

}  // namespace understory::foxglove
