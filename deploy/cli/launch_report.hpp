// Events of a launch: on the terminal, and as JSON for scripts.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "deploy/launch/supervisor.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {

/// The events of a launch; the first 10,000 are stored.
class LaunchReport {
 public:
  /// `quiet`: print nothing.
  explicit LaunchReport(bool quiet) : quiet_(quiet) {}
  /// Adds an event: printed with the time of day, stored for the report.
  void add(const std::string& process, const std::string& text);
  /// Takes HEALTH of a process; a change of its state or reason is an event.
  void add(const health_t& health);
  /// Writes {"processes": [{name, state, restarts, last_ending}], "events": [{time, process,
  /// text}]}. Throws std::runtime_error with the file.
  void write(const std::filesystem::path& file,
             const std::vector<launch::ProcessStatus>& processes) const;

 private:
  struct Event {
    std::string time;
    std::string process;
    std::string text;
  };
  static constexpr std::size_t kMaxEvents = 10'000;
  /// Limit, because any program can send HEALTH.
  static constexpr std::size_t kMaxProcesses = 256;

  bool quiet_;
  std::vector<Event> events_;
  std::map<std::string, std::string> latest_;  ///< Latest state and reason of each process.
};

}  // namespace understory::cli
