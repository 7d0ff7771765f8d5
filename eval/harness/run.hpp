// One run of one method on one simulated drive, scored.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "eval/harness/slam_session.hpp"
#include "eval/metrics/metric.hpp"
#include "sim/drive.hpp"

namespace understory::eval::harness {

/// Scans that make one keyframe (GeoSLAM §5).
inline constexpr std::size_t kScansPerKeyframe = 8;

/// An accepted pose that is farther from the true one is wrong.
inline constexpr double kWrongPose_m = 1.0;

/// A drive with all its scans: every method gets the same ones.
struct RecordedDrive {
  sim::Drive drive;
  std::vector<sim::SimulatedScan> scans;
  std::vector<std::uint32_t> observation_count_of_trunk;

  /// Makes all scans of the drive; they follow from `seed`.
  RecordedDrive(const sim::DriveParameters& parameters, std::uint64_t seed);
};

/// Which poses and trunks a state of a map had: what the oracle estimates for comparison.
struct StateMark {
  std::size_t scans = 0;              ///< Taken in up to this state.
  std::vector<std::size_t> bases;     ///< Scan indices of the poses.
  std::vector<std::uint32_t> trunks;  ///< Trunks nearest to the landmarks, each once, ascending.
};

/// Errors of one state, for the plot of error along the run.
struct StateError {
  std::size_t scans = 0;
  double rpe_m = 0.0;
  double lpe_m = 0.0;
  double newest_pose_m = 0.0;  ///< Position error of the newest pose.
};

/// A keyframe in the middle of the run and the map that it met, for the figures.
struct Snapshot {
  model::Keyframe keyframe;
  model::MapUpdate update;
  std::vector<metrics::PoseEstimate> poses_before;
  std::vector<model::MapLandmark> landmarks_before;
  std::vector<model::MapLandmark> landmarks_after;
};

/// The figures of one run.
struct RunScore {
  metrics::ErrorSums errors;   ///< Over all states.
  int updates = 0;             ///< Keyframes that are in the map at the end.
  int updates_possible = 0;    ///< Scans / 8.
  int wrong_updates = 0;       ///< Accepted with a position error beyond 1 m.
  int new_maps = 0;            ///< Begun because the one before was lost.
  int keyframes_withheld = 0;  ///< By the keyframer or the mapper.
  metrics::MapCompleteness completeness;
  double ate_m = 0.0;
  std::size_t landmarks_in_range = 0;  ///< True trunks ever in range.
  /// Normalised squared error of each accepted pose at its update, by number of the keyframe; 3 on
  /// average if the covariance is right.
  std::vector<std::pair<std::size_t, double>> nees;
};

/// What a run gave, for the plots.
struct RunTrace {
  std::vector<StateError> states;
  metrics::MapState final_map;
  std::optional<Snapshot> snapshot;
  /// In the frame of the map, where the run had a path and trunks of its own; else the drive's.
  std::vector<geometry::SE2> true_path;
  std::vector<Eigen::Vector2d> true_trunks_m;
};

/// Score, trace and states of one run.
struct RunResult {
  RunScore score;
  RunTrace trace;
  std::vector<StateMark> marks;
};

/// Drives a method through the scans and scores every state. States of withheld keyframes count
/// with the map as it then is.
RunResult run_slam(const RecordedDrive& recorded, Stages stages, const std::atomic<bool>& stop);

/// The oracle at the same states, poses and trunks as `marks`.
RunResult run_oracle(const RecordedDrive& recorded, std::span<const StateMark> marks,
                     const std::atomic<bool>& stop);
/// The oracle on its own: a pose and a state every 8 scans, trunks observed at least
/// `min_observation_count` times.
RunResult run_oracle(const RecordedDrive& recorded, const std::atomic<bool>& stop,
                     std::uint32_t min_observation_count = 8);

}  // namespace understory::eval::harness
