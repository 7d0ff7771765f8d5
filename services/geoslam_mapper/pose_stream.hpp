// SLAM_POSE: a pose for each scan, in order of time, whether its keyframe has
// come or not.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "services/geoslam_mapper/given_map.hpp"
#include "services/geoslam_mapper/mapper_output.hpp"
#include "services/geoslam_mapper/pose_publishing.hpp"

namespace understory::geoslam_mapper {

/// Makes the poses that are published: none twice, none older than the last
/// one, each with the odometry's frame, the jumps so far and the covariance of
/// a given map's frame.
class PoseStream {
 public:
  /// What is told of a jump, and which poses are stale; see
  /// describe(MapperOutputParameters&).
  struct Limits {
    double reset_distance_m = 0.5;
    double reset_angle_rad = 0.05;
    double oldest_pose_s = 0.05;
  };

  /// No pose so far, and no map that was given.
  explicit PoseStream(const Limits& limits)
      : limits_(limits), jumps_(limits.reset_distance_m, limits.reset_angle_rad) {}

  /// A map was given.
  void begin_in(const model::WholeMap& map) { given_frame_ = GivenFrame(map); }
  /// Goes on behind so many jumps of a process whose state is lost.
  void begin_behind(std::uint64_t resets) { jumps_.begin_behind(resets); }
  /// To be called after a load.
  void rebuild() { given_frame_.rebuild(); }

  /// Motion; poses are given in its frame, too.
  void on_odometry(const model::Odometry& motion) { odometry_.add(motion); }
  /// A scan between keyframes and what locate() gave for it: its pose, where it
  /// is the newest. `map_id`: of the map in use, 0 where there is none yet.
  std::optional<model::SlamPose> on_scan(const model::LandmarkScan& scan,
                                         const std::optional<ScanPose>& found,
                                         std::uint32_t map_id);
  /// A keyframe and what became of it.
  struct OfKeyframe {
    std::vector<model::SlamPose> poses;  ///< To be published, in this order.
    /// Scans whose pose counts in the budget of MAP from now on. Each counts
    /// once and with its keyframe, whether its pose was published then or
    /// before: scans are not in the journal, and the budget shall be the same
    /// after a restart.
    std::size_t counted = 0;
  };
  /// `is_new_map`: it began another map than the last one's. The scans of a
  /// keyframe that began a map, or found a lost vehicle, are the past.
  OfKeyframe on_keyframe(const model::Keyframe& keyframe, const model::MapUpdate& update,
                         bool is_new_map);

  /// What is not known of the given map's frame there; nothing where the
  /// vehicle left that map.
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
  bool is_provisional_ = false;       ///< The map, by its last keyframe.
  model::Utime newest_utime_ = -1;    ///< Of a published pose.
  model::Utime counted_utime_ = -1;   ///< Poses up to it are counted.
  model::Utime newest_scan_us_ = -1;  ///< Not saved: scans are not in the journal.
};

}  // namespace understory::geoslam_mapper
