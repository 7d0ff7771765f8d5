#include "deploy/cli/status_table.hpp"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

#include "common/terminal/printable.hpp"

namespace understory::cli {
namespace {

using terminal::printable;

const char* state_name(std::int8_t state) {
  switch (state) {
    case health_t::STATE_STARTING:
      return "STARTING";
    case health_t::STATE_OK:
      return "OK";
    case health_t::STATE_DEGRADED:
      return "DEGRADED";
    case health_t::STATE_ERROR:
      return "ERROR";
    case health_t::STATE_STOPPING:
      return "STOPPING";
    default:
      return "?";
  }
}

double mebibytes(std::int64_t bytes) { return static_cast<double>(bytes) / (1024.0 * 1024.0); }

std::string channel_line(const channel_health_t& channel) {
  return fmt::format("  {} {:<24} {:>9} {:>8.1f} {:>7} {:>6} {:>6} {:>9} {:>7}\n",
                     channel.output ? "->" : "<-", printable(channel.channel), channel.messages,
                     channel.rate_hz, channel.lost, channel.duplicates, channel.late,
                     channel.malformed, channel.dropped);
}

nlohmann::ordered_json channel_json(const channel_health_t& channel) {
  return {{"channel", channel.channel},
          {"output", channel.output != 0},
          {"messages", channel.messages},
          {"rate_hz", channel.rate_hz},
          {"gaps", channel.gaps},
          {"lost", channel.lost},
          {"duplicates", channel.duplicates},
          {"late", channel.late},
          {"restarts", channel.restarts},
          {"malformed", channel.malformed},
          {"dropped", channel.dropped}};
}

}  // namespace

void StatusTable::add(const health_t& health, Clock::time_point now) {
  latest_.insert_or_assign(health.process, Entry{health, now});
}

/// "lost 1, LANDMARKS late 12"; empty = no faults.
std::string StatusTable::reason_counts(const health_t& health) {
  std::string result;
  for (const auto& reason : health.reasons) {
    result += fmt::format("{}{}{}{} {}", result.empty() ? "" : ", ", reason.channel,
                          reason.channel.empty() ? "" : " ", reason.reason, reason.count);
  }
  return result;
}

std::int64_t StatusTable::poses_sent() const {
  std::int64_t sent = 0;
  for (const auto& [name, entry] : latest_) {
    for (const channel_health_t& channel : entry.health.channels) {
      if (channel.output != 0 && channel.channel == "SLAM_POSE") sent += channel.messages;
    }
  }
  return sent;
}

std::string StatusTable::text(Clock::time_point now) const {
  std::string result;
  for (const auto& [name, entry] : latest_) {
    const auto& health = entry.health;
    fmt::format_to(std::back_inserter(result),
                   "{} {} pid {} up {:.0f} s, {} handled, latency p50 {:.1f} p99 {:.1f} ms, "
                   "{:.0f} MiB\n",
                   printable(name), entry.silent(now) ? "SILENT" : state_name(health.state),
                   health.pid, health.uptime_s, health.handled,
                   1e-3 * static_cast<double>(health.latency_p50_us),
                   1e-3 * static_cast<double>(health.latency_p99_us), mebibytes(health.rss_bytes));
    if (!health.last_error.empty()) {
      fmt::format_to(std::back_inserter(result), "  last error {}: {}\n", health.last_error_code,
                     printable(health.last_error));
    }
    if (const std::string counts = reason_counts(health); !counts.empty()) {
      fmt::format_to(std::back_inserter(result), "  reasons so far: {}\n", printable(counts));
    }

    result += fmt::format("     {:<24} {:>9} {:>8} {:>7} {:>6} {:>6} {:>9} {:>7}\n", "channel",
                          "messages", "Hz", "lost", "twice", "late", "malformed", "dropped");
    for (const auto& channel : health.channels) result += channel_line(channel);
  }

  return result.empty() ? "no process is heard\n" : result;
}

nlohmann::ordered_json StatusTable::json(Clock::time_point now) const {
  nlohmann::ordered_json processes = nlohmann::ordered_json::array();
  for (const auto& [name, entry] : latest_) {
    const auto& health = entry.health;
    nlohmann::ordered_json process{
        {"process", name},
        {"state", entry.silent(now) ? "SILENT" : state_name(health.state)},
        {"pid", health.pid},
        {"version", health.version},
        {"uptime_s", health.uptime_s},
        {"handled", health.handled},
        {"message_utime", health.message_utime},
        {"latency_p50_us", health.latency_p50_us},
        {"latency_p99_us", health.latency_p99_us},
        {"latency_max_us", health.latency_max_us},
        {"rss_bytes", health.rss_bytes},
        {"last_error_code", health.last_error_code},
        {"last_error", health.last_error},
        {"channels", nlohmann::ordered_json::array()},
        {"reasons", nlohmann::ordered_json::array()}};
    for (const auto& channel : health.channels)
      process["channels"].push_back(channel_json(channel));

    for (const auto& reason : health.reasons) {
      process["reasons"].push_back(
          {{"channel", reason.channel}, {"reason", reason.reason}, {"count", reason.count}});
    }

    processes.push_back(std::move(process));
  }

  return {{"processes", std::move(processes)}};
}

viewer::Verdict pose_verdict(const viewer::Verdict& heard, const StatusTable& table) {
  const std::int64_t sent = table.poses_sent();
  if (heard.state != viewer::Verdict::State::kWaiting || sent == 0) return heard;
  viewer::Verdict verdict = heard;
  verdict.state = viewer::Verdict::State::kSilent;
  verdict.text = fmt::format("no pose comes any more, {} came before", sent);
  return verdict;
}

}  // namespace understory::cli
