// Accuracy of a recorded run against the ground truth in its log.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/io/lcm_log.hpp"
#include "common/model/held_map.hpp"
#include "common/model/map.hpp"
#include "common/model/slam_output.hpp"
#include "deploy/cli/compared_pose.hpp"
#include "deploy/cli/drive_counts.hpp"
#include "deploy/cli/map_tie.hpp"
#include "deploy/cli/truth_track.hpp"
#include "deploy/cli/wrong_stretches.hpp"
#include "understory/health_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::cli {

/// The landmarks of a final map compared with the true ones, frame world.
struct LandmarkAccuracy {
  std::vector<Eigen::Vector2d> landmarks_m;
  std::vector<Eigen::Vector2d> true_landmarks_m;
  std::vector<double> errors_m;     ///< Distance of each compared landmark to the nearest true one.
  std::uint64_t at_a_true_one = 0;  ///< Landmarks within kDoubleWithin_m of the nearest true one.
  std::uint64_t double_pairs = 0;   ///< Pairs of these with the same nearest true one.
};
/// Largest distance of a double from its true landmark [m].
inline constexpr double kDoubleWithin_m = 0.5;
/// Compares the landmarks marked in `is_compared` (by index in `landmarks_m`). `errors_m` and the
/// counts are empty without true landmarks. O(n log n).
LandmarkAccuracy compare_landmarks(std::vector<Eigen::Vector2d> landmarks_m,
                                   const std::vector<bool>& is_compared,
                                   std::vector<Eigen::Vector2d> true_landmarks_m);

/// The errors of one run.
struct DriveAccuracy {
  std::vector<ComparedPose> live;      ///< Every localised pose of SLAM_POSE.
  std::vector<ComparedPose> coasting;  ///< Poses of SLAM_POSE from odometry alone.
  /// Keyframes of the last MAP, later ones as published. Keyframes handed over in a submap have no
  /// covariance here, because theirs is relative to the submap.
  std::vector<ComparedPose> keyframes;
  /// Landmarks of the last map, from MAP and MAP_DELTA. With a given map, landmarks that no
  /// keyframe saw are not compared: TRUTH_LANDMARKS contains only landmarks within range on the
  /// drive, a given map may be larger.
  LandmarkAccuracy landmarks;
  std::uint64_t scans = 0;  ///< LANDMARKS messages in the log.
  std::map<model::MapUpdateStatus, std::uint64_t> updates;
  std::map<std::string, health_t> last_health;  ///< Last HEALTH by process.
  std::uint64_t log_lost = 0;                   ///< LANDMARKS missing in the log itself.
  MapTie tied_at = MapTie::kFirstMap;
  DriveCounts counts;
  bool has_alarms = false;                    ///< HEALTH or LOG is in the log.
  std::vector<WrongStretch> wrong_stretches;  ///< Wrong live and coasting poses.
};

/// Collects a log's events. The map's frame is tied to the world at the base of the first keyframe,
/// or at the first instant of the map recorded with its truth: there is no alignment, so an error
/// of this heading is included. A given map has its own frame (MapTie). If the mapper began another
/// map, each map is tied separately.
class DriveAccuracyCollector {
 public:
  /// `truth_sigma`: accuracy of GROUND_TRUTH, added to the covariances of compared poses.
  explicit DriveAccuracyCollector(const geometry::TruthSigma& truth_sigma = {})
      : truth_sigma_(truth_sigma) {}

  /// Takes one event, in the order of the log; unused channels are only counted.
  void add(const io::LogEvent& event);
  /// None when the log has no ground truth at any instant of the map.
  std::optional<DriveAccuracy> finish() const;

 private:
  /// A published pose, and its reception time in the log [us].
  struct LivePose {
    model::SlamPose pose;
    std::int64_t log_utime = 0;
  };
  void add_truth(const io::LogEvent& event);
  void add_map(const io::LogEvent& event);
  void add_words(const io::LogEvent& event);
  void add_landmarks_event(const io::LogEvent& event);
  void add_pose(const model::SlamPose& pose, std::int64_t log_utime);
  void add_update(const model::MapUpdate& update);
  std::optional<ComparedPose> compare(model::Utime utime,
                                      const geometry::SE2WithCovariance& map_T_vehicle,
                                      const TiedMap& tied, std::uint32_t map_id) const;
  /// Compares localised and coasting poses in the order of the log; fills both lists of `accuracy`.
  std::vector<ComparedPose> compare_live(DriveAccuracy& accuracy) const;
  std::vector<ComparedPose> compare_keyframes(const model::WholeMap& whole,
                                              const TiedMap& tied) const;
  LandmarkAccuracy compare_map(const model::WholeMap& whole,
                               const geometry::SE2& world_T_map) const;

  geometry::TruthSigma truth_sigma_;
  TruthTrack truth_;
  truth_landmarks_t true_landmarks_{};
  std::vector<LivePose> poses_;  ///< Localised and coasting ones.
  MapTies ties_;
  model::HeldMap map_;
  std::set<model::LandmarkId> seen_;  ///< Landmarks seen by a keyframe in the log.
  std::optional<std::int64_t> last_scan_;
  DriveCounter counter_;
  AlarmCollector alarms_;
  DriveAccuracy counted_;
};

}  // namespace understory::cli
