// What happened during a launch: on the terminal as it happens, and as JSON for scripts.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "deploy/launch/supervisor.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {

/// The events of a launch; the first 10,000 are kept.
class LaunchReport {
 public:
  /// `quiet`: print nothing.
  explicit LaunchReport(bool quiet) : quiet_(quiet) {}
  /// One thing that happened: printed with the time of day, kept for the report.
  void add(const std::string& process, const std::string& text);
  /// HEALTH of a process: where its state or the reason for it has changed, that is one thing.
  void add(const health_t& health);
  /// Writes {"processes": [{name, state, restarts, last_ending}], "events": [{time, process,
  /// text}]}. Throws std::runtime_error naming the file.
  void write(const std::filesystem::path& file,
             const std::vector<launch::ProcessStatus>& processes) const;

 private:
  struct Event {
    std::string time;
    std::string process;
    std::string text;
  };
  static constexpr std::size_t kMaxEvents = 10'000;
  static constexpr std::size_t kMaxProcesses = 256;  ///< Anybody can send HEALTH.

  bool quiet_;
  std::vector<Event> events_;
  std::map<std::string, std::string> latest_;  ///< Of each process: what its HEALTH said last.
};

}  // namespace understory::cli
