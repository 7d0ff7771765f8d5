// How the frames of other processes lie to the map: from poses of the same moment.
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

/// Frame `parent` to frame `child`, in the plane.
struct FrameLink {
  std::string_view parent;
  std::string_view child;
  geometry::SE2 parent_T_child;
};

/// Poses of the last moments by stamp; memory: 64 of them.
class RecentPoses {
 public:
  /// Takes a pose; older ones than the newest are passed over.
  void add(model::Utime utime, const geometry::SE2& pose);
  /// The pose of a stamp within 10 ms, the nearest; none where there is none.
  std::optional<geometry::SE2> at(model::Utime utime) const;

 private:
  static constexpr std::size_t kMost = 64;
  static constexpr model::Utime kTolerance_us = 10'000;
  std::deque<std::pair<model::Utime, geometry::SE2>> poses_;
};

/// For display alone. `ekf_map` follows the map at every pose that both have; `world`, the frame of
/// the ground truth, is tied to a map once, at the first localised pose.
class FrameLinks {
 public:
  /// The filter's pose.
  void take(const model::EkfPose& pose);
  /// Ground truth: world_T_vehicle.
  void take_truth(model::Utime utime, const geometry::SE2& world_T_vehicle);
  /// The mapper's pose; call after what came before it.
  void take(const model::SlamPose& pose);

  /// All that is known: vehicle, odom, ekf_map, world, each in map. Empty before the first pose.
  std::vector<FrameLink> links() const;
  /// Stamp of the last pose.
  model::Utime utime() const { return pose_ ? pose_->utime : 0; }
  /// Where the vehicle of the last pose really was, in the map; none where that is not known.
  std::optional<geometry::SE2> true_pose() const;

 private:
  RecentPoses filter_;  ///< ekf_map_T_vehicle.
  RecentPoses truth_;   ///< world_T_vehicle.
  std::optional<model::SlamPose> pose_;
  std::optional<geometry::SE2> map_T_ekf_map_;
  std::optional<geometry::SE2> map_T_world_;
};

/// Whether the pose in the map means something.
bool is_usable(const model::SlamPose& pose);

}  // namespace understory::foxglove
