// The latest HEALTH of every process, and whether it is still running.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "services/viewer/landmark_table.hpp"
#include "understory/health_t.hpp"

namespace understory::viewer {

/// State of a process on this computer, from the operating system.
struct ProcessSample {
  bool is_running = false;  ///< Neither ended nor stopped by a signal.
  double cpu_s = 0.0;       ///< Processor time used so far.
};

/// Processes by name.
class ProcessBoard {
 public:
  /// HEALTH is sent once a second; a process without it for longer is silent [us].
  static constexpr std::int64_t kSilent_us = 1'500'000;

  /// A process.
  struct Entry {
    health_t health;
    std::int64_t heard_us = 0;  ///< Wall clock.
    bool has_ended = false;     ///< By the operating system.
    bool is_silent = false;
    std::optional<double> cpu_share;  ///< Of one processor, over the last second or more.
    std::optional<double> cpu_s;      ///< At the last sample ...
    std::int64_t cpu_us = 0;          ///< ... and the time of that sample.
  };

  /// `changes` is the scene's counter and must outlive it.
  explicit ProcessBoard(Change& changes) : changes_(&changes) {}

  /// Adds a message received at `wall_us`.
  void take(const health_t& health, std::int64_t wall_us);
  /// Adds the operating system's state of a process.
  void take(const std::string& process, const ProcessSample& sample, std::int64_t wall_us);
  /// Marks silent processes at this time.
  void look(std::int64_t wall_us);

  /// All processes.
  const std::map<std::string, Entry>& entries() const { return entries_; }
  /// Number of the latest change.
  Change change() const { return change_; }
  /// Wall clock of the last look() [us].
  std::int64_t looked_us() const { return looked_us_; }
  /// Removes all processes.
  void clear();

 private:
  static constexpr std::size_t kMostProcesses = 100;
  Change* changes_;
  Change change_ = 0;
  std::int64_t looked_us_ = 0;
  std::map<std::string, Entry> entries_;
};

}  // namespace understory::viewer
