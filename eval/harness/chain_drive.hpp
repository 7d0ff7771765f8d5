// The whole chain, from raw sensors to SLAM_POSE, on a simulated drive, against the truth.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/existence.hpp"
#include "common/model/map.hpp"
#include "common/model/slam_output.hpp"
#include "eval/harness/false_detections.hpp"
#include "eval/harness/sensor_chain.hpp"
#include "eval/metrics/victoria_park_score.hpp"
#include "sim/sensor_drive.hpp"

namespace understory::eval::harness {

/// The map right after an update.
struct MapAfterUpdate {
  std::vector<model::KeyframePose> keyframes;
  std::vector<model::MapLandmark> landmarks;
};

/// What EXISTENCE says of the map around the vehicle.
struct MappingSignal {
  double missing_share = 0.0;
  double new_share = 0.0;
  bool is_needed = false;  ///< `mapping_needed`.
};

/// What the chain published on a drive, and the truth.
struct ChainRun {
  std::vector<metrics::StampedPose> truth;          ///< `world`, at the truth's own rate.
  std::vector<metrics::StampedPose> dead_reckoned;  ///< RAW_POSE: the filter corrects its velocity.
  std::vector<metrics::StampedPose> odometry;  ///< ODOMETRY, summed: no landmark has touched it.
  std::vector<model::EkfPose> ekf;
  std::vector<model::SlamPose> slam;      ///< Those that are localised.
  std::vector<model::SlamPose> coasting;  ///< By odometry alone, between keyframes.
  std::uint64_t slam_unsure = 0;  ///< SLAM_POSE that are not localised, coasting ones included.
  std::vector<model::MapUpdate> updates;
  std::vector<MapAfterUpdate> states;          ///< One for each update, where they were asked for.
  std::vector<model::KeyframePose> keyframes;  ///< As estimated at the end.
  std::vector<model::MapLandmark> landmarks;   ///< Of the last map.
  std::vector<std::size_t> detections;         ///< Of each sweep.
  std::vector<model::LandmarkScan> scans;      ///< LANDMARKS, where they were asked for.
  std::vector<model::Odometry> motions;        ///< ODOMETRY, likewise.
  std::uint64_t sweeps = 0;
  double simulated_s = 0.0;
  std::map<model::LandmarkId, model::LandmarkExistence> existence;  ///< As told last.
  std::vector<model::ExistenceState> existence_states;
  std::vector<MappingSignal> mapping_signals;  ///< Of each EXISTENCE.
  FalseDetectionCounts false_detections;       ///< Where the options put some in.
  std::map<std::string, ServiceTime> times;
  std::map<std::string, health_t> health;
};

/// A reading before it reaches the chain: may be changed, dropped (empty) or repeated.
using Meddle = std::function<std::vector<RawMessage>(RawMessage)>;

/// A process that does not run for a while, of the drive's time.
struct ChainPause {
  std::string service;  ///< Empty = all of them.
  double from_s = 0.0;
  double to_s = 0.0;
};

/// How a simulated drive goes through the chain.
struct ChainOptions {
  std::filesystem::path config_dir;  ///< Its launch.toml says which services; empty: all.
  std::map<std::string, std::string> toml_instead;
  std::set<std::string> without;           ///< Services that launch.toml has, and this drive not.
  double end_s = 1e9;                      ///< Of the drive.
  Meddle meddle;                           ///< Faults; empty = none.
  std::vector<ChainPause> pauses;          ///< Of processes.
  FalseDetectionOptions false_detections;  ///< Put among the extractor's.
  std::function<void(double done)> progress;  ///< Called at every sweep; `done` is in [0, 1].
  /// Every sweep before it goes to the chain, with the truth in it.
  std::function<void(const sim::SimulatedSweep&)> on_sweep;
  bool keep_measurements = false;  ///< LANDMARKS and ODOMETRY as a whole.
  bool keep_states = false;        ///< Asks for the whole map after each update.
};

/// The messages of a reading: one, but sweeps come in parts, and truth gives none. `sweep_parts`
/// counts the parts of the whole drive.
std::vector<RawMessage> raw_messages(const sim::SensorReading& reading, std::uint64_t& sweep_parts);

/// Keeps in `run` what the chain publishes; to be called before the first message is fed.
void watch_chain(SensorChain& chain, ChainRun& run);
/// Ends the drive: last outputs of the services, their times and health.
void finish_chain(SensorChain& chain, ChainRun& run);

/// The services from raw sensors to the map, in the order in which data runs through them.
std::vector<bus::Service> front_end_services();
/// Those of them that the folder's launch.toml starts, but for the viewer, the store and a sensor's
/// driver: a log or the simulation stands for that. All where the path is empty. Throws
/// ConfigurationError, also for a process that is none of them.
std::vector<bus::Service> services_of(const std::filesystem::path& config_dir);

/// Drives once through. Throws what a service or `options.progress` throws.
ChainRun drive_chain(sim::SensorDrive& drive, const ChainOptions& options);

/// Errors after one rigid alignment (SE(2), over all given poses).
struct TrajectoryError {
  std::size_t poses = 0;
  double ate_rms_m = 0.0;
  double largest_m = 0.0;
  double end_m = 0.0;  ///< With the first pose held instead: error at the end of the drive.
  double driven_m = 0.0;
};
/// Errors of `estimate` (in order of time) at its own stamps; poses outside of the truth's time are
/// left out.
TrajectoryError trajectory_error(std::span<const metrics::StampedPose> estimate,
                                 std::span<const metrics::StampedPose> truth);
/// The same of SLAM_POSE, each map aligned by itself: its frame has no tie to the others'. Of the
/// end errors the largest one, of `driven_m` the sum.
TrajectoryError trajectory_error(std::span<const model::SlamPose> poses,
                                 std::span<const metrics::StampedPose> truth);
/// The SLAM_POSE of each scan that has one, localised or coasting, in order of time: what a driver
/// steers by.
std::vector<model::SlamPose> live_poses(const ChainRun& run);
/// Number of maps in which the poses are.
std::size_t count_maps(std::span<const model::SlamPose> poses);

/// Errors against the reported covariance, with the first pose of each map held: it is its frame.
struct PoseConsistency {
  double mean_nees = 0.0;    ///< Of the pose; 3 is exact.
  std::vector<double> nees;  ///< Of each pose but the first of a map, in order of time.
  double end_error_m = 0.0;
  double end_sigma_m = 0.0;  ///< Root of the trace of the position's covariance.
};
/// Consistency of SLAM_POSE. The truth is interpolated at the stamps of the poses.
PoseConsistency pose_consistency(std::span<const model::SlamPose> poses,
                                 std::span<const metrics::StampedPose> truth);

/// Updates that were accepted more than `limit_m` from the truth, after one rigid alignment: the
/// heading error of a single first scan (3 mrad) would be 6 m at the end of a road.
std::size_t wrong_updates(const ChainRun& run, double limit_m = 1.0);

/// Stamps and poses of EKF_POSE, frame `ekf_map`.
std::vector<metrics::StampedPose> poses_of(std::span<const model::EkfPose> poses);
/// Stamps and poses of SLAM_POSE, frame `map`.
std::vector<metrics::StampedPose> poses_of(std::span<const model::SlamPose> poses);
/// Stamps and poses of keyframes' bases, frame `map`.
std::vector<metrics::StampedPose> poses_of(std::span<const model::KeyframePose> keyframes);

}  // namespace understory::eval::harness
