// How often what happened in a recorded run.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/io/lcm_log.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"

namespace understory::cli {

/// Number of a closure within all maps of a run: its map and its id.
using ClosureKey = std::pair<std::uint32_t, std::uint64_t>;

/// Loop closures of a run. Repeated messages of one closure count once.
struct ClosureCounts {
  std::uint64_t sent = 0;      ///< By LOOP_CLOSURE.
  std::uint64_t accepted = 0;  ///< By the last LOOP_RESULT of each, as the following ones.
  std::uint64_t waiting = 0;
  std::uint64_t revoked = 0;
  std::uint64_t refused = 0;
  std::map<std::string, std::uint64_t> refused_by_reason;
};

/// Counts of a run's messages.
struct DriveCounts {
  /// Of SLAM_POSE, by the names that its statuses have in slam_pose2_t, in lower case.
  std::map<std::string, std::uint64_t> poses_by_status;
  std::uint64_t reset_counter_steps = 0;     ///< By how much SLAM_POSE.reset_counter grew.
  std::uint64_t keyframes_sent = 0;          ///< KEYFRAME in the log.
  std::uint64_t keyframes_without_pose = 0;  ///< SLAM_UPDATE with neither FIRST_MAP nor UPDATED.
  ClosureCounts closures;
  std::map<std::string, std::uint64_t> bytes_by_channel;  ///< Payloads, without sensors and truth.
};

/// Counts a log's messages one by one.
class DriveCounter {
 public:
  /// Takes every event, whatever its channel is.
  void take(const io::LogEvent& event);
  void take(const model::SlamPose& pose);        ///< As published; in order of the log.
  void take(const model::MapUpdate& update);     ///< Each once.
  void take(const model::LoopClosure& closure);  ///< May come repeatedly.
  void take(const model::LoopResult& result);    ///< The last one of a closure counts.
  /// So far.
  DriveCounts counts() const;

 private:
  DriveCounts counts_;
  std::optional<std::uint64_t> reset_counter_;
  std::map<ClosureKey, std::optional<model::LoopResult>> closures_;
};

}  // namespace understory::cli
