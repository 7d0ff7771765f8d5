// All processes from raw sensors to the map, driven by lcm-logplayer.
#pragma once

#include <fmt/format.h>

#include <map>
#include <set>

#include "common/bus/bulk_group.hpp"
#include "common/geometry/decompositions.hpp"
#include "common/io/lcm_log.hpp"
#include "common/model/ekf_output.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/system/stack.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::test {

inline const std::vector<std::string> kChainProcesses = {"lidar_imu_input",   "landmark_extractor",
                                                         "associator",        "ekf",
                                                         "keyframer",         "geoslam_mapper",
                                                         "submap_store",      "loop_closer",
                                                         "existence_tracker", "viewer"};

/// A recorded drive of the simulated vehicle through a forest, and where it really was.
class RecordedSensors {
 public:
  RecordedSensors(double length_m, std::uint64_t seed) {
    const Outcome outcome = understory_command(
        directory_, fmt::format("sim forest3d --lidar vlp16 --distance {} --cruise 4 --standstill "
                                "5 --seed {} --out {}",
                                length_m, seed, log()));
    if (outcome.status != 0) throw std::runtime_error(outcome.error);
    io::LcmLogReader reader(log());
    while (const auto event = reader.next()) {
      if (event->channel == "RAW_SWEEP") last_sweep_ = event->utime;
      if (event->channel != "GROUND_TRUTH") continue;
      const auto truth = wire::decode_message<ground_truth_t>(event->data);
      truth_[truth->utime] = wire::from_wire(truth->world_T_vehicle);
    }
  }

  std::string log() const { return directory_ / "drive.lcm"; }
  /// Stamp of the log's last sweep [us].
  model::Utime last_sweep() const { return last_sweep_; }
  /// The true pose, between two that are 20 ms apart.
  std::optional<geometry::SE2> at(model::Utime utime) const {
    const auto after = truth_.lower_bound(utime);
    if (after == truth_.end()) return std::nullopt;
    if (after->first == utime || after == truth_.begin()) return after->second;
    const auto before = std::prev(after);
    const double part = static_cast<double>(utime - before->first) /
                        static_cast<double>(after->first - before->first);
    return before->second *
           geometry::SE2::Exp(part * (before->second.inverse() * after->second).Log());
  }

 private:
  TemporaryDirectory directory_;
  std::map<model::Utime, geometry::SE2> truth_;
  model::Utime last_sweep_ = 0;
};

/// `understory launch` with the configuration of a LIDAR vehicle, and what it publishes.
class ChainStack {
 public:
  ChainStack() : bus_(url_) {
    bus_.subscribe("HEALTH", 0, [this](const bus::BusMessage& message) {
      const auto one = wire::decode_message<health_t>(message.bytes);
      if (!one) return;
      health[one->process] = *one;
      pids[one->process].insert(one->pid);
    });
    bus_.subscribe("SLAM_POSE", 0, [this](const bus::BusMessage& message) {
      const auto pose = wire::decode_message<model::SlamPose>(message.bytes);
      if (pose && pose->is_localised()) slam.push_back(*pose);
    });
    bus_.subscribe("EKF_POSE", 0, [this](const bus::BusMessage& message) {
      if (const auto pose = wire::decode_message<model::EkfPose>(message.bytes))
        ekf.push_back(*pose);
    });
    start();
  }
  ~ChainStack() {
    for (const auto& player : players_) player.signal(SIGKILL);
    stop();
  }

  /// Launches the processes, with the state that they may have left.
  void start() {
    launch_ = launch::ChildProcess::start(
        {UNDERSTORY_COMMAND,
         {"launch", "--config", UNDERSTORY_SOURCE_CONFIG "/lidar", "--state-dir",
          directory_ / "state", "--lcm-url", url_, "--report", report(), "--quiet"},
         {}});
  }

  /// Handles messages until the condition holds; false after so long.
  template <class Condition>
  bool wait_until(Condition condition, double seconds = 30.0) {
    const auto end = SteadyClock::now() + Seconds(seconds);
    while (!condition()) {
      if (SteadyClock::now() > end) return false;
      bus_.handle_one(10);
    }
    return true;
  }
  bool wait_for_processes() {
    return wait_until([&] {
      return std::ranges::all_of(kChainProcesses, [&](const auto& name) { return pid(name) > 0; });
    });
  }
  /// Two players, as sweeps travel in a group of their own.
  void play(const std::string& log) {
    const auto start = [&](const std::string& url, const std::string& channels) {
      players_.push_back(launch::ChildProcess::start(
          {"lcm-logplayer", {"--lcm-url", url, "--regexp", channels, log}, {}}));
    };
    start(bus::bulk_lcm_url(url_), "^RAW_SWEEP$");
    start(url_, "^RAW_(IMU|WHEELS|GNSS)$");
  }
  pid_t pid(const std::string& process) const {
    const auto found = health.find(process);
    return found == health.end() ? -1 : static_cast<pid_t>(found->second.pid);
  }

  /// SIGTERM; gives how launch ended.
  launch::Ending stop() {
    if (!launch_) return ending_;
    launch_->signal(SIGTERM);
    wait_until([&] {
      const auto ended = launch_->ended();
      if (ended) ending_ = *ended;
      return ended.has_value();
    });
    launch_.reset();
    return ending_;
  }
  std::string report() const { return directory_ / "report.json"; }
  /// The map of the first drive.
  std::filesystem::path map_file() const {
    return directory_.path() / "state" / "submap_store" / "maps" / "drive-0001.gpkg";
  }

  std::map<std::string, health_t> health;              ///< Latest of each process.
  std::map<std::string, std::set<std::int64_t>> pids;  ///< All that each process has had.
  std::vector<model::SlamPose> slam;                   ///< Localised ones.
  std::vector<model::EkfPose> ekf;

 private:
  TemporaryDirectory directory_;
  std::string url_ = private_url();
  bus::LiveBus bus_;
  std::vector<launch::ChildProcess> players_;
  std::optional<launch::ChildProcess> launch_;
  launch::Ending ending_;
};

/// Position errors of poses [m], the first one of each frame held; -1 where there are none.
struct LargestErrors {
  double any_m = -1.0;
  double unstated_m =
      -1.0;  ///< Of those that are out of the 99.99 % ellipsoid of their covariance.
};

/// `pose_of`: a pose in its map; `frame_of`: which map that is.
template <class Pose, class PoseOf, class FrameOf>
LargestErrors largest_errors(const std::vector<Pose>& poses, const RecordedSensors& drive,
                             PoseOf pose_of, FrameOf frame_of) {
  constexpr double kOutside = 21.1;  // Of chi-squared, three degrees of freedom.
  const Eigen::Matrix3d slack = 1e-6 * Eigen::Matrix3d::Identity();
  std::map<std::uint32_t, geometry::SE2> world_T_maps;
  LargestErrors largest;
  for (const Pose& one : poses) {
    const auto truth = drive.at(one.utime);
    if (!truth) continue;
    const geometry::SE2 world_T_map =
        world_T_maps.try_emplace(frame_of(one), *truth * pose_of(one).inverse()).first->second;
    const Eigen::Vector3d error = ((world_T_map * pose_of(one)).inverse() * *truth).Log();
    const double error_m = error.head<2>().norm();
    const Eigen::Matrix3d information = geometry::symmetric_inverse(one.covariance + slack);
    largest.any_m = std::max(largest.any_m, error_m);
    if (error.dot(information * error) > kOutside)
      largest.unstated_m = std::max(largest.unstated_m, error_m);
  }
  return largest;
}

}  // namespace understory::test
