// HEALTH of all processes as a table or as JSON.
#pragma once

#include <chrono>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "services/viewer/shown_pose.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {

/// The latest HEALTH of every process.
class StatusTable {
 public:
  /// The clock that determines when a process is silent.
  using Clock = std::chrono::steady_clock;
  /// HEALTH is published once a second: after three missing ones the process counts as silent.
  static constexpr std::chrono::seconds kSilent{3};

  /// Replaces the process's latest message.
  void add(const health_t& health, Clock::time_point now);
  /// True before the first message.
  bool empty() const { return latest_.empty(); }
  /// Number of SLAM_POSE that the processes state to have sent since their start.
  std::int64_t poses_sent() const;
  /// The table for a terminal, one process per line; texts of the processes are escaped.
  std::string text(Clock::time_point now) const;
  /// The same for scripts.
  nlohmann::ordered_json json(Clock::time_point now) const;

 private:
  static std::string reason_counts(const health_t& health);

  struct Entry {
    health_t health;
    Clock::time_point received;
    bool silent(Clock::time_point now) const { return now - received >= kSilent; }
  };
  std::map<std::string, Entry> latest_;  ///< Latest entry by name of the process.
};

/// State of the pose: from the poses received; where none was received, from HEALTH. If poses were
/// sent before, it is silent; without any, it is waiting.
viewer::Verdict pose_verdict(const viewer::Verdict& heard, const StatusTable& table);

}  // namespace understory::cli
