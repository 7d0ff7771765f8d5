// SLAM_POSE: one pose per scan, in order of time, before or with its keyframe.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "services/geoslam_mapper/given_map.hpp"
#include "services/geoslam_mapper/mapper_output.hpp"
#include "services/geoslam_mapper/pose_publishing.hpp"

namespace understory::geoslam_mapper {

/// Makes the poses to publish: each stamp once, never older than the last one, with the odometry
/// frame, the number of jumps and the covariance of a given map's frame.
class PoseStream {
 public:
  /// Limits for jumps and for stale poses; see describe(MapperOutputParameters&).
  struct Limits {
    double reset_distance_m = 0.5;
    double reset_angle_rad = 0.05;
    double oldest_pose_s = 0.05;
  };

  /// No pose and no given map yet.
  explicit PoseStream(const Limits& limits)
      : limits_(limits), jumps_(limits.reset_distance_m, limits.reset_angle_rad) {}

  /// A map was given.
  void begin_in(const model::WholeMap& map) { given_frame_ = GivenFrame(map); }
  /// Continues counting after the jumps of a process whose state is lost.
  void begin_behind(std::uint64_t resets) { jumps_.begin_behind(resets); }
  /// To be called after a load.
  void rebuild() { given_frame_.rebuild(); }

  /// Adds an increment; the poses contain the sum of increments, too.
  void on_odometry(const model::Odometry& motion) { odometry_.add(motion); }
  /// A scan between keyframes and the result of locate(): its pose, if it is the newest. `map_id`:
  /// of the map in use, 0 before the first.
  std::optional<model::SlamPose> on_scan(const model::LandmarkScan& scan,
                                         const std::optional<ScanPose>& found,
                                         std::uint32_t map_id);
  /// The outputs of a keyframe.
  struct OfKeyframe {
    std::vector<model::SlamPose> poses;  ///< To be published, in this order.
    /// Number of scans that this keyframe adds to the budget of MAP. Each scan counts once, with
    /// its keyframe, even if its pose was published before: scans are not in the journal, and the
    /// budget must be the same after a restart.
    std::size_t counted = 0;
  };
  /// Adds a keyframe and its result. `is_new_map`: it began another map than the last one's. Scans
  /// of a keyframe that began a map, or localised a lost vehicle, get no pose: they are in the
  /// past.
  OfKeyframe on_keyframe(const model::Keyframe& keyframe, const model::MapUpdate& update,
                         bool is_new_map);

  /// Covariance of the given map's frame at the pose; zero if the map in use is another one.
  Eigen::Matrix3d given_covariance_at(const geometry::SE2& map_T_vehicle,
                                      std::uint32_t map_id) const;

  /// Members of a saved state; see common/state. The limits are configuration,
  /// and scans are in no journal. After a load call rebuild().
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.odometry_, self.jumps_, self.given_frame_, self.is_provisional_, self.newest_utime_,
      self.counted_utime_);
  }

 private:
  void complete(model::SlamPose& pose);

  Limits limits_;
  OdometryFrame odometry_;
  JumpWatch jumps_;
  GivenFrame given_frame_;
  bool is_provisional_ = false;       ///< The map at its last keyframe.
  model::Utime newest_utime_ = -1;    ///< Of the newest published pose.
  model::Utime counted_utime_ = -1;   ///< Poses up to this stamp are counted.
  model::Utime newest_scan_us_ = -1;  ///< Not saved: scans are not in the journal.
};

}  // namespace understory::geoslam_mapper
