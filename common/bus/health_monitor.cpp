#include "common/bus/health_monitor.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace understory::bus {

HealthMonitor::HealthMonitor(std::string process, std::string version, Clock clock)
    : process_(std::move(process)),
      version_(std::move(version)),
      clock_(std::move(clock)),
      started_us_(clock_.monotonic_us()),
      reported_us_(started_us_),
      reasons_(clock_) {}

std::size_t HealthMonitor::add_channel(std::string name, bool is_output) {
  Channel channel;
  channel.name = std::move(name);
  channel.is_output = is_output;
  channels_.push_back(std::move(channel));
  return channels_.size() - 1;
}

void HealthMonitor::count_message(std::size_t channel, std::int64_t utime) {
  ++channels_[channel].messages;
  channels_[channel].last_utime = std::max(channels_[channel].last_utime, utime);
  if (!channels_[channel].is_output) ++handled_;
}

void HealthMonitor::count_reason(std::string_view channel, wire::Reason reason,
                                 std::string_view text) {
  for (Channel& one : channels_) {
    if (one.name == channel && is_malformed(reason)) ++one.malformed;
    if (one.name == channel && reason == wire::Reason::kNotSent) ++one.dropped;
  }
  reasons_.add(channel, reason, text);
}

void HealthMonitor::set_sequence(std::size_t channel, const SequenceCounts& counts) {
  Channel& one = channels_[channel];
  if (counts.gaps > one.sequence.gaps) {
    reasons_.add_degraded("messages_lost", one.name + ": messages that did not arrive: " +
                                               std::to_string(counts.lost) + " so far");
  }
  one.sequence = counts;
}

void HealthMonitor::set_dropped(std::size_t channel, std::uint64_t dropped) {
  const auto now = static_cast<std::int64_t>(dropped);
  Channel& one = channels_[channel];
  if (now > one.dropped) {
    reasons_.add_degraded(to_string(wire::Reason::kQueueFull),
                          one.name + ": more came than could be handled: " + std::to_string(now) +
                              " messages dropped so far");
  }
  one.dropped = now;
}

std::int8_t HealthMonitor::state() const {
  if (is_stopping_) return health_t::STATE_STOPPING;
  if (!is_ready_) return health_t::STATE_STARTING;
  switch (reasons_.fresh()) {
    case Severity::kError:
      return health_t::STATE_ERROR;
    case Severity::kDegraded:
      return health_t::STATE_DEGRADED;
    default:
      return health_t::STATE_OK;
  }
}

channel_health_t HealthMonitor::channel_report(Channel& channel, double seconds) {
  channel_health_t out{};
  out.channel = channel.name;
  out.output = channel.is_output ? 1 : 0;
  out.messages = channel.messages;
  const auto fresh = static_cast<double>(channel.messages - channel.messages_reported);
  out.rate_hz = seconds > 0.0 ? fresh / seconds : 0.0;
  channel.messages_reported = channel.messages;

  out.gaps = static_cast<std::int64_t>(channel.sequence.gaps);
  out.lost = static_cast<std::int64_t>(channel.sequence.lost);
  out.duplicates = static_cast<std::int64_t>(channel.sequence.duplicates);
  out.late = static_cast<std::int64_t>(channel.sequence.late);
  out.restarts = static_cast<std::int64_t>(channel.sequence.restarts);
  out.malformed = channel.malformed;
  out.dropped = channel.dropped;
  out.last_utime = channel.last_utime;
  return out;
}

health_t HealthMonitor::report(std::int64_t message_utime) {
  const std::int64_t now = clock_.monotonic_us();
  const double seconds = static_cast<double>(now - reported_us_) * 1e-6;
  reported_us_ = now;

  // Identity and state.
  health_t out{};
  out.utime = clock_.wall_us();
  out.seq = sequence_++;
  out.process = process_;
  out.version = version_;
  out.pid = ::getpid();
  out.state = state();
  out.uptime_s = static_cast<double>(now - started_us_) * 1e-6;
  out.message_utime = message_utime;
  out.handled = handled_;
  out.rss_bytes = resident_memory_bytes();
  out.snapshot_utime = -1;

  // Latency.
  const LatencyHistogram window = latencies_.report();
  out.latency_p50_us = window.quantile(0.5);
  out.latency_p90_us = window.quantile(0.9);
  out.latency_p99_us = window.quantile(0.99);
  out.latency_max_us = window.max();

  // Channels and reasons.
  for (Channel& channel : channels_) out.channels.push_back(channel_report(channel, seconds));
  out.num_channels = static_cast<std::int32_t>(out.channels.size());
  reasons_.fill(out);
  return out;
}

std::int64_t resident_memory_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t total_pages = 0;
  std::int64_t resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return 0;
  return resident_pages * ::sysconf(_SC_PAGESIZE);
}

}  // namespace understory::bus
