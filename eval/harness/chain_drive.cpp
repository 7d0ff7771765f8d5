#include "eval/harness/chain_drive.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "common/bus/launch_config.hpp"
#include "common/geometry/alignment.hpp"
#include "services/associator/adapter.hpp"
#include "services/ekf/adapter.hpp"
#include "services/existence_tracker/adapter.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "services/landmark_extractor/adapter.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "services/loop_closer/adapter.hpp"
#include "understory/map_request_t.hpp"

namespace understory::eval::harness {
namespace {

/// Asks for the whole map as often as there were updates since the last call.
void keep_states(SensorChain& chain, ChainRun& run) {
  if (run.states.size() == run.updates.size()) return;
  map_request_t request{};
  request.utime = run.updates.back().utime;
  request.seq = static_cast<std::int64_t>(run.states.size());
  request.everything = 1;
  chain.feed("MAP_REQUEST", wire::encode_message(request));
  run.states.resize(run.updates.size(), {run.keyframes, run.landmarks});
}

/// Drivers read the sensor itself, which only a process can.
constexpr std::string_view kSensorDriver = "_driver";
/// Keeps files; experiments read what is on the bus.
constexpr std::string_view kStore = "submap_store";
constexpr const char* kViewer = "viewer";  ///< Nobody looks.

/// What fits into one packet of the bus: 10 bytes a point.
constexpr std::size_t kPointsPerPart = 5500;

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

model::Utime utime_of(const sim::SensorReading& reading) {
  return std::visit(Overloaded{[](const sim::SimulatedSweep& sweep) { return sweep.raw.utime; },
                               [](const sim::SimulatedPlanarScan& scan) { return scan.scan.utime; },
                               [](const auto& value) { return value.utime; }},
                    reading);
}

/// Stops and starts the services whose pause it is.
void apply_pauses(SensorChain& chain, const std::vector<ChainPause>& pauses, double now_s) {
  if (pauses.empty()) return;
  for (const std::string& service : chain.services()) {
    chain.pause(service, std::ranges::any_of(pauses, [&](const ChainPause& pause) {
                  const bool is_meant = pause.service.empty() || pause.service == service;
                  return is_meant && now_s >= pause.from_s && now_s < pause.to_s;
                }));
  }
}

}  // namespace

void watch_chain(SensorChain& chain, ChainRun& run) {
  chain.watch<model::RawPose>("RAW_POSE", [&run](const model::RawPose& pose) {
    run.dead_reckoned.push_back({pose.utime, pose.odom_T_vehicle});
  });
  chain.watch<model::Odometry>("ODOMETRY", [&run](const model::Odometry& motion) {
    if (run.odometry.empty()) run.odometry.push_back({motion.from_utime, {}});
    run.odometry.push_back({motion.utime, run.odometry.back().pose * motion.from_T_to});
  });
  chain.watch<model::LandmarkScan>("LANDMARKS", [&run](const model::LandmarkScan& scan) {
    run.detections.push_back(scan.detections.size());
  });
  chain.watch<model::EkfPose>("EKF_POSE",
                              [&run](const model::EkfPose& pose) { run.ekf.push_back(pose); });

  chain.watch<model::SlamPose>("SLAM_POSE", [&run](const model::SlamPose& pose) {
    if (pose.is_localised()) {
      run.slam.push_back(pose);
      return;
    }
    ++run.slam_unsure;
    if (!pose.status) run.coasting.push_back(pose);
  });

  chain.watch<model::MapUpdate>(
      "SLAM_UPDATE", [&run](const model::MapUpdate& update) { run.updates.push_back(update); });
  chain.watch<model::Existence>("EXISTENCE", [&run](const model::Existence& existence) {
    for (const model::LandmarkExistence& one : existence.landmarks) run.existence[one.id] = one;
    run.mapping_signals.push_back(
        {existence.missing_share, existence.new_share, existence.is_mapping_needed});
  });
  chain.watch<model::ExistenceState>("EXISTENCE_STATE", [&run](const model::ExistenceState& state) {
    run.existence_states.push_back(state);
  });
  chain.watch<model::WholeMap>("MAP", [&run](const model::WholeMap& map) {
    if (!map.complete) return;
    run.landmarks = map.landmarks;
    run.keyframes = map.keyframes;
  });
}

namespace {

void watch_measurements(SensorChain& chain, ChainRun& run) {
  chain.watch<model::Odometry>(
      "ODOMETRY", [&run](const model::Odometry& motion) { run.motions.push_back(motion); });
  chain.watch<model::LandmarkScan>(
      "LANDMARKS", [&run](const model::LandmarkScan& scan) { run.scans.push_back(scan); });
}

}  // namespace

void finish_chain(SensorChain& chain, ChainRun& run) {
  chain.finish();
  for (const std::string& service : chain.services()) {
    run.times[service] = chain.time_of(service);
    run.health[service] = chain.health_of(service);
  }
}

std::vector<bus::Service> front_end_services() {
  return {lidar_imu_input::lidar_imu_input_service(),
          landmark_extractor::landmark_extractor_service(),
          associator::associator_service(),
          ekf::ekf_service(),
          keyframer::keyframer_service(),
          geoslam_mapper::geoslam_mapper_service()};
}

std::vector<bus::Service> services_of(const std::filesystem::path& config_dir) {
  std::vector<bus::Service> all = front_end_services();
  if (config_dir.empty()) return all;
  all.push_back(loop_closer::loop_closer_service());
  all.push_back(existence_tracker::existence_tracker_service());
  std::set<std::string> started;
  for (const bus::ProcessEntry& entry : bus::read_launch_config(config_dir).processes) {
    if (!entry.is_service || entry.name.ends_with(kSensorDriver) || entry.name == kStore ||
        entry.name == kViewer)
      continue;
    if (std::ranges::find(all, entry.name, &bus::Service::name) == all.end()) {
      throw bus::ConfigurationError({(config_dir / "launch.toml").string() + ": process \"" +
                                     entry.name + "\" cannot be hosted here"});
    }
    started.insert(entry.name);
  }

  std::erase_if(all, [&](const bus::Service& one) { return !started.contains(one.name); });
  return all;
}

std::vector<RawMessage> raw_messages(const sim::SensorReading& reading,
                                     std::uint64_t& sweep_parts) {
  const auto one = [](const char* channel, const auto& value) {
    return std::vector<RawMessage>{{value.utime, channel, wire::encode_message(value)}};
  };
  return std::visit(
      Overloaded{[](const sim::TruePose&) { return std::vector<RawMessage>(); },
                 [&](const model::ImuSample& sample) { return one("RAW_IMU", sample); },
                 [&](const model::WheelSample& sample) { return one("RAW_WHEELS", sample); },
                 [&](const model::GnssFix& fix) { return one("RAW_GNSS", fix); },
                 [&](const sim::SimulatedPlanarScan& scan) { return one("RAW_SCAN", scan.scan); },
                 [&](const sim::SimulatedSweep& sweep) {
                   std::vector<RawMessage> messages;
                   for (model::PointSweep& part : split_sweep(sweep.raw, kPointsPerPart)) {
                     part.sequence = sweep_parts++;
                     messages.push_back({part.utime, "RAW_SWEEP", wire::encode_message(part)});
                   }
                   return messages;
                 }},
      reading);
}

namespace {

/// The extractor gives to the service that puts false detections among its own.
void put_in(const FalseDetectionOptions& options, const sim::SensorDrive& drive,
            const std::shared_ptr<FalseDetectionCounts>& counts,
            std::vector<bus::Service>& services) {
  constexpr const char* kFound = "LANDMARKS_FOUND";
  const auto extractor = std::ranges::find(services, "landmark_extractor", &bus::Service::name);
  if (extractor == services.end()) return;
  landmark_extractor::LandmarkExtractorChannels channels;
  channels.all.rename(channels.landmarks, kFound);
  *extractor = landmark_extractor::landmark_extractor_service(channels);
  const auto truth = [&drive](model::Utime utime) { return drive.state_at(utime).world_T_level(); };
  services.insert(std::next(extractor),
                  false_detection_service(options, truth, counts, kFound, "LANDMARKS"));
}

}  // namespace

ChainRun drive_chain(sim::SensorDrive& drive, const ChainOptions& options) {
  ChainRun run;
  std::vector<bus::Service> services = services_of(options.config_dir);
  std::erase_if(services, [&](const auto& one) { return options.without.contains(one.name); });
  const auto false_counts = std::make_shared<FalseDetectionCounts>();
  if (options.false_detections.share > 0.0)
    put_in(options.false_detections, drive, false_counts, services);
  SensorChain chain(services, options.config_dir, options.toml_instead);
  watch_chain(chain, run);
  if (options.keep_measurements) watch_measurements(chain, run);

  const double duration_s = std::min(options.end_s, drive.motion().duration_s());
  std::uint64_t sweep_parts = 0;
  std::optional<model::Utime> begin;

  while (const auto reading = drive.next()) {
    const model::Utime utime = utime_of(*reading);
    begin = begin.value_or(utime);
    run.simulated_s = 1e-6 * static_cast<double>(utime - *begin);
    if (run.simulated_s > options.end_s) break;
    apply_pauses(chain, options.pauses, run.simulated_s);

    if (const auto* truth = std::get_if<sim::TruePose>(&*reading)) {
      run.truth.push_back({truth->utime, truth->state.world_T_level()});
    }
    if (std::holds_alternative<sim::SimulatedSweep>(*reading)) {
      ++run.sweeps;
      if (options.progress) options.progress(run.simulated_s / duration_s);
      if (options.on_sweep) options.on_sweep(std::get<sim::SimulatedSweep>(*reading));
    }

    for (RawMessage& message : raw_messages(*reading, sweep_parts)) {
      if (!options.meddle) {
        chain.feed(message);
        continue;
      }
      for (const RawMessage& changed : options.meddle(std::move(message))) chain.feed(changed);
    }
    if (options.keep_states) keep_states(chain, run);
  }

  finish_chain(chain, run);
  run.false_detections = *false_counts;
  return run;
}

TrajectoryError trajectory_error(std::span<const metrics::StampedPose> estimate,
                                 std::span<const metrics::StampedPose> truth) {
  TrajectoryError error;
  std::vector<Eigen::Vector2d> estimated;
  std::vector<Eigen::Vector2d> real;
  std::optional<geometry::SE2> truth_T_estimate;
  for (const metrics::StampedPose& pose : estimate) {
    const auto true_pose = pose_at(truth, pose.utime);
    if (!true_pose) continue;
    if (!truth_T_estimate) truth_T_estimate = *true_pose * pose.pose.inverse();
    if (!real.empty()) error.driven_m += (true_pose->translation() - real.back()).norm();
    estimated.push_back(pose.pose.translation());
    real.push_back(true_pose->translation());
  }
  error.poses = real.size();
  if (real.size() < 2) return error;
  error.end_m = (*truth_T_estimate * estimated.back() - real.back()).norm();
  const geometry::SE2 aligned = geometry::align_rigid(real, estimated);
  double sum = 0.0;
  for (std::size_t i = 0; i < real.size(); ++i) {
    const double squared = (aligned * estimated[i] - real[i]).squaredNorm();
    sum += squared;
    error.largest_m = std::max(error.largest_m, std::sqrt(squared));
  }
  error.ate_rms_m = std::sqrt(sum / static_cast<double>(real.size()));
  return error;
}

namespace {

std::map<std::uint32_t, std::vector<model::SlamPose>> by_map(
    std::span<const model::SlamPose> poses) {
  std::map<std::uint32_t, std::vector<model::SlamPose>> maps;
  for (const model::SlamPose& pose : poses) maps[pose.map_id].push_back(pose);
  return maps;
}

}  // namespace

TrajectoryError trajectory_error(std::span<const model::SlamPose> poses,
                                 std::span<const metrics::StampedPose> truth) {
  TrajectoryError all;
  double sum = 0.0;
  for (const auto& [id, of_map] : by_map(poses)) {
    const TrajectoryError error = trajectory_error(poses_of(of_map), truth);
    sum += static_cast<double>(error.poses) * error.ate_rms_m * error.ate_rms_m;
    all.poses += error.poses;
    all.driven_m += error.driven_m;
    all.largest_m = std::max(all.largest_m, error.largest_m);
    all.end_m = std::max(all.end_m, error.end_m);
  }
  if (all.poses > 0) all.ate_rms_m = std::sqrt(sum / static_cast<double>(all.poses));
  return all;
}

std::vector<model::SlamPose> live_poses(const ChainRun& run) {
  std::vector<model::SlamPose> poses = run.slam;
  poses.insert(poses.end(), run.coasting.begin(), run.coasting.end());
  std::ranges::stable_sort(poses, {}, &model::SlamPose::utime);
  return poses;
}

std::size_t count_maps(std::span<const model::SlamPose> poses) { return by_map(poses).size(); }

PoseConsistency pose_consistency(std::span<const model::SlamPose> poses,
                                 std::span<const metrics::StampedPose> truth) {
  PoseConsistency result;
  std::optional<geometry::SE2> map_T_world;
  std::uint32_t map_id = 0;
  for (const model::SlamPose& pose : poses) {
    const auto true_pose = pose_at(truth, pose.utime);
    if (!true_pose) continue;
    if (pose.map_id != map_id) map_T_world.reset();
    map_id = pose.map_id;
    const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
    if (!map_T_world) {
      map_T_world = map_T_vehicle * true_pose->inverse();
      continue;
    }
    const Eigen::Vector3d error =
        (map_T_vehicle.inverse() * *map_T_world * *true_pose).coordinates();
    // A micrometre, a microradian: the first keyframe's own poses may be exact.
    const Eigen::Matrix3d covariance = pose.covariance + 1e-12 * Eigen::Matrix3d::Identity();
    result.nees.push_back(error.dot(covariance.inverse() * error));
    result.end_error_m = error.head<2>().norm();
    result.end_sigma_m = std::sqrt(covariance.topLeftCorner<2, 2>().trace());
  }
  const double sum = std::accumulate(result.nees.begin(), result.nees.end(), 0.0);
  result.mean_nees = sum / std::max(1.0, static_cast<double>(result.nees.size()));
  return result;
}

std::size_t wrong_updates(const ChainRun& run, double limit_m) {
  struct Points {
    std::vector<Eigen::Vector2d> estimated;
    std::vector<Eigen::Vector2d> real;
  };
  std::map<std::uint32_t, Points> maps;
  for (const model::MapUpdate& update : run.updates) {
    const auto true_pose = pose_at(run.truth, update.utime);
    if (!metrics::localised(update) || !true_pose) continue;
    maps[update.map_id].estimated.push_back(update.map_T_vehicle.translation());
    maps[update.map_id].real.push_back(true_pose->translation());
  }

  std::size_t wrong = 0;
  for (const auto& [id, points] : maps) {
    const geometry::SE2 world_T_map = geometry::align_rigid(points.real, points.estimated);
    for (std::size_t i = 0; i < points.real.size(); ++i) {
      if ((world_T_map * points.estimated[i] - points.real[i]).norm() > limit_m) ++wrong;
    }
  }
  return wrong;
}

std::vector<metrics::StampedPose> poses_of(std::span<const model::EkfPose> poses) {
  std::vector<metrics::StampedPose> result;
  for (const model::EkfPose& pose : poses) result.push_back({pose.utime, pose.ekf_map_T_vehicle});
  return result;
}

std::vector<metrics::StampedPose> poses_of(std::span<const model::SlamPose> poses) {
  std::vector<metrics::StampedPose> result;
  for (const model::SlamPose& pose : poses) result.push_back({pose.utime, pose.map_T_vehicle()});
  return result;
}

std::vector<metrics::StampedPose> poses_of(std::span<const model::KeyframePose> keyframes) {
  std::vector<metrics::StampedPose> result;
  for (const model::KeyframePose& one : keyframes) result.push_back({one.utime, one.map_T_vehicle});
  return result;
}

}  // namespace understory::eval::harness
