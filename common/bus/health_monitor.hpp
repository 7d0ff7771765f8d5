// The health of a process: counts, rates, latencies, and the resulting state.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/bus/clock.hpp"
#include "common/bus/latency_histogram.hpp"
#include "common/bus/reason_counts.hpp"
#include "common/bus/sequence_tracker.hpp"
#include "common/wire/result.hpp"
#include "understory/health_t.hpp"

namespace understory::bus {

/// Latencies since the report before the last one, so that percentiles do not jump at a report.
class LatencyWindow {
 public:
  /// Counts one latency [us].
  void add(std::int64_t microseconds) { latest_.add(microseconds); }
  /// The latencies since the report before the last one; begins a new part.
  LatencyHistogram report() {
    LatencyHistogram window = before_;
    window.merge(latest_);
    before_ = std::exchange(latest_, {});
    return window;
  }

 private:
  LatencyHistogram latest_;
  LatencyHistogram before_;
};

/// Collects the values of one process for HEALTH.
class HealthMonitor {
 public:
  /// `process` and `version` as HEALTH shows them.
  HealthMonitor(std::string process, std::string version, Clock clock);

  /// Adds a channel; returns its index. HEALTH lists channels in the order of adding.
  std::size_t add_channel(std::string name, bool is_output);
  /// Counts a message on a channel, by its stamp [us].
  void count_message(std::size_t channel, std::int64_t utime);
  /// Counts the time from receiving a message to the end of its handler [us].
  void count_latency(std::int64_t microseconds) { latencies_.add(microseconds); }
  /// Counts a fault of a message on a channel, or of the process (empty channel).
  void count_reason(std::string_view channel, wire::Reason reason, std::string_view text);
  /// Sets whether a condition holds; see ReasonCounts. True where this is a change.
  bool set_condition(std::string_view channel, wire::Reason reason, bool holds,
                     std::string_view text) {
    return holds ? reasons_.hold(channel, reason, text) : reasons_.release(channel, reason);
  }
  /// Sets the sequence counts of an input; a new gap degrades the state.
  void set_sequence(std::size_t channel, const SequenceCounts& counts);
  /// Sets how many messages the bus dropped; an increase degrades the state.
  void set_dropped(std::size_t channel, std::uint64_t dropped);
  /// Sets the counts of refused datagrams; an increase degrades the state.
  void set_refused(const DatagramFaults& faults) { reasons_.set_refused(faults); }

  /// From now on the state follows from the reasons; before it is STARTING.
  void ready() { is_ready_ = true; }
  /// From now on the state is STOPPING.
  void stop() { is_stopping_ = true; }
  /// The state in the terms of health_t: STARTING, OK, DEGRADED, ERROR or STOPPING.
  std::int8_t state() const;

  /// The message for HEALTH. Rates are over the time since the last call, latencies since the call
  /// before that. The caller adds buffers, journal and snapshot.
  health_t report(std::int64_t message_utime);
  /// Count of this reason on this channel.
  std::int64_t count_of(std::string_view channel, wire::Reason reason) const {
    return reasons_.count_of(channel, reason);
  }

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

  static channel_health_t channel_report(Channel& channel, double seconds);

  std::string process_;
  std::string version_;
  Clock clock_;
  std::int64_t started_us_;
  std::int64_t reported_us_;
  bool is_ready_ = false;
  bool is_stopping_ = false;
  std::vector<Channel> channels_;
  ReasonCounts reasons_;
  LatencyWindow latencies_;
  std::int64_t handled_ = 0;
  std::int64_t sequence_ = 0;
};

/// Resident memory of this process [bytes]; 0 where it cannot be read.
std::int64_t resident_memory_bytes();

}  // namespace understory::bus
