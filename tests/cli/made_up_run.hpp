// Events of a run that never was: its numbers are known.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/wire/convert.hpp"
#include "deploy/cli/accuracy_report.hpp"
#include "deploy/cli/drive_accuracy.hpp"
#include "understory/config_t.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/log_t.hpp"

namespace understory::test {

/// Builds events in the order of time; sequence numbers are given by itself.
class MadeUpRun {
 public:
  static constexpr model::Utime kStart = 1'700'000'000'000'000;
  static model::Utime at(double seconds) {
    return kStart + static_cast<model::Utime>(std::llround(1e6 * seconds));
  }

  /// Any message, received at that time.
  template <class Message>
  void send(double seconds, const std::string& channel, const Message& message) {
    events_.push_back({static_cast<std::int64_t>(events_.size()), at(seconds), channel,
                       wire::encode_message(message)});
  }

  void truth(double seconds, const geometry::SE2& world_T_vehicle) {
    ground_truth_t truth{};
    truth.utime = at(seconds);
    truth.seq = static_cast<std::int64_t>(next_["GROUND_TRUTH"]++);
    truth.world_T_vehicle = wire::to_wire(world_T_vehicle);
    send(seconds, "GROUND_TRUTH", truth);
  }

  /// A keyframe's update.
  void update(double seconds, const geometry::SE2& map_T_vehicle,
              model::MapUpdateStatus status = model::MapUpdateStatus::kUpdated) {
    model::MapUpdate update;
    update.keyframe_sequence = next_["SLAM_UPDATE"]++;
    update.utime = at(seconds);
    update.status = status;
    update.map_T_vehicle = update.map_T_latest_vehicle = map_T_vehicle;
    send(seconds, "SLAM_UPDATE", update);
  }

  /// A scan's pose between keyframes, unless `change` makes it something else.
  template <class Change>
  void pose(double seconds, const geometry::SE2& map_T_vehicle, const Eigen::Matrix3d& covariance,
            const Change& change) {
    model::SlamPose pose;
    pose.utime = at(seconds);
    pose.sequence = next_["SLAM_POSE"]++;
    pose.submap_T_vehicle = map_T_vehicle;
    pose.covariance = covariance;
    change(pose);
    send(seconds, "SLAM_POSE", pose);
  }
  void pose(double seconds, const geometry::SE2& map_T_vehicle, const Eigen::Matrix3d& covariance) {
    pose(seconds, map_T_vehicle, covariance, [](model::SlamPose& /*pose*/) {});
  }

  void map(double seconds, model::WholeMap map) {
    map.utime = at(seconds);
    map.sequence = next_["MAP"]++;
    map.version = map.sequence + 1;
    send(seconds, "MAP", map);
  }

  void health(double seconds, const std::string& process, std::int8_t state) {
    health_t health{};
    health.utime = at(seconds);
    health.seq = static_cast<std::int64_t>(next_[process]++);
    health.process = process;
    health.state = state;
    send(seconds, "HEALTH", health);
  }

  void log(double seconds, const std::string& process, std::int8_t level, const std::string& code,
           const std::string& text) {
    log_t log{};
    log.utime = at(seconds);
    log.seq = static_cast<std::int64_t>(next_["LOG" + process]++);
    log.process = process;
    log.level = level;
    log.code = code;
    log.text = text;
    send(seconds, "LOG", log);
  }

  std::optional<cli::DriveAccuracy> accuracy(const geometry::TruthSigma& truth_sigma = {}) const {
    cli::DriveAccuracyCollector collector(truth_sigma);
    for (const auto& event : events_) collector.add(event);
    return collector.finish();
  }

 private:
  std::vector<io::LogEvent> events_;
  std::map<std::string, std::uint64_t> next_;
};

}  // namespace understory::test
