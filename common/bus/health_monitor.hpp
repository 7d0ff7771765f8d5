// How a process is: counts, rates, latencies, and the state that follows from them.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/clock.hpp"
#include "common/bus/latency_histogram.hpp"
#include "common/bus/sequence_tracker.hpp"
#include "common/wire/result.hpp"
#include "understory/health_t.hpp"

namespace understory::bus {

/// How bad a reason is while it is fresh (kFreshUs).
enum class Severity : std::uint8_t {
  kNote,      ///< Counted; the state stays OK.
  kDegraded,  ///< Input or output is missing or wrong.
  kError,     ///< The service does not do what it is for.
};
Severity severity(wire::Reason reason);

class HealthMonitor {
 public:
  /// A reason counts towards the state for this long [us].
  static constexpr std::int64_t kFreshUs = 3000000;

  HealthMonitor(std::string process, std::string version, Clock clock);

  /// Channels are given in the order in which they are added.
  std::size_t add_channel(std::string name, bool is_output);
  void count_message(std::size_t channel, std::int64_t utime);
  void count_latency(std::int64_t microseconds);
  void count_reason(std::string_view channel, wire::Reason reason, std::string_view text);
  void set_sequence(std::size_t channel, const SequenceCounts& counts);
  void set_dropped(std::size_t channel, std::uint64_t dropped);

  /// STARTING until the first call of ready(), STOPPING after stop(), else from the reasons.
  void ready() { is_ready_ = true; }
  void stop() { is_stopping_ = true; }
  std::int8_t state() const;

  /// The message for HEALTH; rates and latencies are over the time since about two calls ago.
  health_t report(std::int64_t message_utime);
  /// What report() does not know is set by the caller: buffers, journal, snapshot.

  const std::map<std::pair<std::string, std::string>, std::int64_t>& reasons() const {
    return reasons_;
  }
  std::int64_t count_of(std::string_view channel, wire::Reason reason) const;

 private:
  struct Channel {
    std::string name;
    bool is_output = false;
    std::int64_t messages = 0;
    std::int64_t messages_reported = 0;
    std::int64_t malformed = 0;
    std::int64_t dropped = 0;
    std::int64_t last_utime = -1;
    SequenceCounts sequence;
  };

  channel_health_t channel_report(Channel& channel, double seconds) const;

  std::string process_;
  std::string version_;
  Clock clock_;
  std::int64_t started_us_;
  std::int64_t reported_us_;
  bool is_ready_ = false;
  bool is_stopping_ = false;
  std::vector<Channel> channels_;
  std::map<std::pair<std::string, std::string>, std::int64_t> reasons_;  // channel, reason
  std::int64_t last_degraded_us_;
  std::int64_t last_error_us_;
  std::int64_t handled_ = 0;
  std::int64_t sequence_ = 0;
  LatencyHistogram latest_;
  LatencyHistogram before_;
  std::string last_code_;
  std::string last_text_;
  std::int64_t last_text_utime_ = -1;
};

/// Resident memory of this process [bytes]; 0 where it cannot be told.
std::int64_t resident_memory_bytes();

}  // namespace understory::bus
