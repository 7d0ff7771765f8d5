// The latest HEALTH of every process, and whether the process is still there.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "services/viewer/landmark_table.hpp"
#include "understory/health_t.hpp"

namespace understory::viewer {

/// What the operating system says of a process on this computer.
struct ProcessSample {
  bool is_running = false;  ///< Neither ended nor stopped by a signal.
  double cpu_s = 0.0;       ///< Processor time used so far.
};

/// By name of the process.
class ProcessBoard {
 public:
  /// HEALTH comes once a second; who says nothing for longer is silent [us].
  static constexpr std::int64_t kSilent_us = 1'500'000;

  /// A process.
  struct Entry {
    health_t health;
    std::int64_t heard_us = 0;  ///< Wall clock.
    bool has_ended = false;     ///< By the operating system.
    bool is_silent = false;
    std::optional<double> cpu_share;  ///< Of one processor, over the last second or more.
    std::optional<double> cpu_s;      ///< When it was last looked at ...
    std::int64_t cpu_us = 0;          ///< ... which was then.
  };

  /// `changes` is the scene's counter and must outlive it.
  explicit ProcessBoard(Change& changes) : changes_(&changes) {}

  /// Takes a message that was heard at `wall_us`.
  void take(const health_t& health, std::int64_t wall_us);
  /// Takes what the operating system says of a process.
  void take(const std::string& process, const ProcessSample& sample, std::int64_t wall_us);
  /// Time passes: who is silent.
  void look(std::int64_t wall_us);

  /// All of them.
  const std::map<std::string, Entry>& entries() const { return entries_; }
  /// Number of the latest change.
  Change change() const { return change_; }
  /// Wall clock of the last look() [us].
  std::int64_t looked_us() const { return looked_us_; }
  /// Nobody was heard.
  void clear();

 private:
  static constexpr std::size_t kMostProcesses = 100;
  Change* changes_;
  Change change_ = 0;
  std::int64_t looked_us_ = 0;
  std::map<std::string, Entry> entries_;
};

}  // namespace understory::viewer
