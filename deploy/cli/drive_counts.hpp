// Counts of events in a recorded run.
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

/// Key of a closure over all maps of a run: its map and its id.
using ClosureKey = std::pair<std::uint32_t, std::uint64_t>;

/// Loop closures of a run. Repeated messages of one closure count once.
struct ClosureCounts {
  std::uint64_t sent = 0;      ///< Counted from LOOP_CLOSURE.
  std::uint64_t accepted = 0;  ///< By the last LOOP_RESULT of each, like the following counts.
  std::uint64_t waiting = 0;
  std::uint64_t revoked = 0;
  std::uint64_t refused = 0;
  std::map<std::string, std::uint64_t> refused_by_reason;
};

/// Counts of a run's messages.
struct DriveCounts {
  /// Counts of SLAM_POSE by the names of its statuses in slam_pose2_t, in lower case.
  std::map<std::string, std::uint64_t> poses_by_status;
  std::uint64_t reset_counter_steps = 0;     ///< Growth of SLAM_POSE.reset_counter.
  std::uint64_t keyframes_sent = 0;          ///< KEYFRAME messages in the log.
  std::uint64_t keyframes_without_pose = 0;  ///< SLAM_UPDATE with neither FIRST_MAP nor UPDATED.
  ClosureCounts closures;
  std::map<std::string, std::uint64_t>
      bytes_by_channel;  ///< Bytes of payloads, without sensors and truth.
};

/// Counts a log's messages one by one.
class DriveCounter {
 public:
  /// Takes every event of any channel.
  void take(const io::LogEvent& event);
  void take(const model::SlamPose& pose);        ///< Takes a published pose, in order of the log.
  void take(const model::MapUpdate& update);     ///< Takes an update, each once.
  void take(const model::LoopClosure& closure);  ///< Takes a closure, which may be repeated.
  /// Takes a result; the last one of a closure is used.
  void take(const model::LoopResult& result);
  /// The counts so far.
  DriveCounts counts() const;

 private:
  DriveCounts counts_;
  std::optional<std::uint64_t> reset_counter_;
  std::map<ClosureKey, std::optional<model::LoopResult>> closures_;
};

}  // namespace understory::cli
