// What became of the keyframes, poses and landmarks of a drive.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "eval/experiments/loops/loop_drive.hpp"

namespace understory::eval::experiments::loops {

/// Counts and errors of a drive that need more than its final path.
struct DriveFate {
  std::size_t rolled_back = 0;   ///< Keyframes that were fused and taken back.
  std::size_t without_pose = 0;  ///< Keyframes that were not sure of their place, or empty.
  double live_ate_m = 0.0;       ///< Of SLAM_POSE as it was told, after one rigid alignment.
  std::size_t live_poses = 0;    ///< These: the poses in the last map.
  double nees = 0.0;  ///< Mean over the keyframes of the final map, relative to its first; 3.
  double within_95_pct = 0.0;   ///< Keyframes whose NEES is below the 95 % quantile, 7.81.
  std::size_t trees = 0;        ///< That have a landmark in the final map.
  std::size_t doubled = 0;      ///< Of these: that have two or more.
  double first_quarter_ms = 0;  ///< Mean processor time of a frame, loop closer included.
  double last_quarter_ms = 0;
  /// Closures that the mapper did not accept at once, by what it said.
  std::map<std::string, std::size_t> not_accepted;
};

/// Follows a drive's messages.
class DriveWatch {
 public:
  /// `drive` must outlive the watch.
  explicit DriveWatch(const LoopDrive& drive);

  /// In order of arrival, each message once.
  void follow(const model::MapUpdate& update);
  void follow(const model::MapDelta& delta);
  void follow(const model::SlamPose& pose);
  void follow(const model::LoopResult& result);
  /// Processor time of a frame [ms], in order of frames.
  void frame_took(double ms) { frames_ms_.push_back(ms); }

  /// At the end of the drive. `map_T_first`: where the frame of the drive's truth is in the map.
  DriveFate sum_up(const model::WholeMap& map, const geometry::SE2& map_T_first) const;

 private:
  struct LivePose {
    std::size_t frame = 0;
    std::uint32_t map_id = 0;
    geometry::SE2 map_T_vehicle;
  };
  void merge(model::LandmarkId old_id, model::LandmarkId new_id);
  void count_trees(const model::WholeMap& map, DriveFate& fate) const;
  void count_nees(const model::WholeMap& map, const geometry::SE2& map_T_first,
                  DriveFate& fate) const;
  void measure_live(DriveFate& fate) const;

  const LoopDrive& drive_;
  std::map<model::Utime, std::size_t> frame_at_;
  std::map<model::LandmarkId, std::map<int, int>> votes_;  ///< Detections by tree.
  std::vector<LivePose> live_;
  std::set<model::Utime> told_;
  std::vector<double> frames_ms_;
  DriveFate fate_;
};

}  // namespace understory::eval::experiments::loops
