// Publishes LOG and CONFIG of a process.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "common/bus/bus.hpp"
#include "common/wire/result.hpp"

namespace understory::bus {

/// Severity of a line of LOG, numbered as in log_t.
enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError };

/// Publishes LOG and CONFIG under the process's name and numbers them.
class Announcer {
 public:
  /// `bus` must outlive it.
  Announcer(Bus& bus, std::string process, std::string version);

  /// While muted, nothing is published or numbered: a recovery repeats messages that were published
  /// before.
  void mute(bool is_muted) { is_muted_ = is_muted; }

  /// One line of LOG. `utime`: message time [us]; -1 (none yet) becomes 0.
  void log(std::int64_t utime, LogLevel level, std::string_view code, std::string_view text,
           std::string_view channel);
  /// Publishes a line of LOG for the 1st, 2nd, 4th, 8th ... report of each reason and channel: a
  /// flood of bad input must not cause a flood of LOG.
  void report(std::int64_t utime, wire::Reason reason, std::string_view text,
              std::string_view channel);
  /// Publishes a line of LOG for each kind of refused datagram whose count has doubled.
  void report_refused(std::int64_t utime, const DatagramFaults& faults);
  /// Publishes the configuration in force.
  void config(std::int64_t utime, const std::string& toml);

 private:
  Bus& bus_;
  std::string process_;
  std::string version_;
  bool is_muted_ = false;
  std::int64_t log_sequence_ = 0;
  std::int64_t config_sequence_ = 0;
  std::map<std::pair<std::string, std::string>, std::uint64_t> reported_;  // reason, channel
  DatagramFaults refused_;                                                 // as last reported
};

}  // namespace understory::bus
