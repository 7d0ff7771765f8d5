// Publishes for `launch` on the bus on behalf of processes that are given up.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bus/announcer.hpp"
#include "common/bus/live_bus.hpp"
#include "deploy/launch/supervisor.hpp"

namespace understory::cli {

/// HEALTH in the name of processes that are given up, LOG in the name of `launch`.
class LaunchVoice {
 public:
  /// Throws BusError with the URL where the bus cannot be used.
  explicit LaunchVoice(const std::string& lcm_url);

  /// Publishes HEALTH once a second for each process that is given up and does not run: ERROR,
  /// `given_up`, its ending, and pid 0. LOG reports when a process is given up, and when this ends.
  /// Call it with every status; cheap.
  void tell(const std::vector<launch::ProcessStatus>& processes, launch::Clock::time_point now);
  /// Publishes a warning in LOG. `code`: like a reason in HEALTH.
  void warn(const std::string& code, const std::string& text);

 private:
  void publish_health(const launch::ProcessStatus& process);

  bus::LiveBus bus_;
  bus::Announcer announcer_;
  std::set<std::string> given_up_;
  std::map<std::string, std::int64_t> sequences_;  ///< Sequence numbers of HEALTH by process.
  std::optional<launch::Clock::time_point> told_;  ///< Time of the last HEALTH.
};

}  // namespace understory::cli
