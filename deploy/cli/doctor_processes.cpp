#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <set>

#include "common/model/sensor_channel.hpp"
#include "common/terminal/printable.hpp"
#include "deploy/cli/doctor_findings.hpp"

namespace understory::cli {
namespace {

using terminal::printable;

constexpr const char* kRestart = "understory launch (it ends with Ctrl-C and starts all anew)";

/// The last HEALTH of each process by name and number.
using Latest = std::map<std::pair<std::string, std::int64_t>, health_t>;

void name_findings(const Latest& latest, std::vector<Finding>& findings) {
  std::map<std::string, std::string> pids;
  for (const auto& [key, health] : latest) {
    if (key.second <= 0) continue;  // Published by the supervisor for a process that is given up.
    pids[key.first] += fmt::format("{}{}", pids[key.first].empty() ? "" : ", ", key.second);
  }
  for (const auto& [name, list] : pids) {
    if (list.find(',') == std::string::npos) continue;
    findings.push_back({Verdict::kBad, "processes",
                        fmt::format("{} runs more than once (processes {}): what they publish is "
                                    "mixed",
                                    printable(name), list),
                        "kill all but one of them"});
  }
}

void version_findings(const Latest& latest, const std::string& version,
                      std::vector<Finding>& findings) {
  std::map<std::string, std::string> names;
  for (const auto& [key, health] : latest)
    names[health.version] += fmt::format(" {}", printable(key.first));
  if (names.empty() || (names.size() == 1 && names.begin()->first == version)) return;
  std::string text = fmt::format("the command is {}", version);
  for (const auto& [running, list] : names)
    text += fmt::format("; {}:{}", printable(running), list);
  findings.push_back({Verdict::kBad, "versions", "they differ: " + text, kRestart});
}

void state_findings(const Latest& latest, std::vector<Finding>& findings) {
  for (const auto& [key, health] : latest) {
    const bool is_error = health.state == health_t::STATE_ERROR;
    if (!is_error && health.state != health_t::STATE_DEGRADED) continue;
    findings.push_back(
        {is_error ? Verdict::kBad : Verdict::kAdvice, "processes",
         fmt::format("{} is {}: {}: {}", printable(key.first), is_error ? "in error" : "degraded",
                     printable(health.last_error_code), printable(health.last_error)),
         "understory status (counts by channel and reason)"});
  }
}

/// Lost and dropped messages, by channel.
void loss_findings(const Latest& latest, std::vector<Finding>& findings) {
  constexpr double kBadShare = 0.01;
  constexpr std::int64_t kFew = 10;
  for (const auto& [key, health] : latest) {
    for (const channel_health_t& channel : health.channels) {
      const std::int64_t lost = channel.lost + channel.dropped;
      if (lost < kFew) continue;
      const double share = static_cast<double>(lost) / static_cast<double>(std::max<std::int64_t>(
                                                           channel.messages + channel.lost, 1));
      findings.push_back({share >= kBadShare ? Verdict::kBad : Verdict::kAdvice, "losses",
                          fmt::format("{} lost {} of {} messages ({:.1f} %)", printable(key.first),
                                      lost, printable(channel.channel), 100.0 * share),
                          "deploy/setup --tune (receive buffers); a processor that is busy: top"});
    }
  }
}

void buffer_findings(const Latest& latest, std::vector<Finding>& findings) {
  std::string names;
  for (const auto& [key, health] : latest) {
    if (health.receive_buffer_bytes < health.receive_buffer_wanted_bytes)
      names += fmt::format(" {}", printable(key.first));
  }
  if (names.empty()) return;
  findings.push_back({Verdict::kAdvice, "receive buffer", "smaller than was asked for:" + names,
                      "deploy/setup --tune, then start them again"});
}

/// Subscribed channels of sensors of one kind.
struct SensorInputs {
  bool is_taken = false;  ///< The process subscribes one of this kind.
  bool is_heard = false;

  void note(const channel_health_t& channel) {
    is_taken = true;
    is_heard = is_heard || channel.rate_hz > 0.0;
  }
  bool is_missing() const { return is_taken && !is_heard; }
};

/// Sensors' channels without messages at the first process of the chain. Other processes (the
/// viewer, a recorder) also have inputs of sensors, and RAW_POSE, which is not a sensor's channel.
void sensor_findings(const Latest& latest, std::vector<Finding>& findings) {
  for (const auto& [key, health] : latest) {
    SensorInputs laser;
    SensorInputs motion;
    std::string silent;
    for (const channel_health_t& channel : health.channels) {
      if (channel.output != 0 || !model::is_sensor_channel(channel.channel)) continue;
      const std::string& name = channel.channel;
      if (name == "RAW_SWEEP" || name == "RAW_SCAN") laser.note(channel);
      if (name == "RAW_IMU" || name == "RAW_WHEELS") motion.note(channel);
      if (channel.rate_hz <= 0.0) silent += fmt::format(" {}", printable(name));
    }

    const char* const advice =
        "is the sensor's driver running, on this bus (lcm-spy: deploy/spy)? RAW_SWEEP comes in the "
        "second group, one port higher";
    if (laser.is_missing() || motion.is_missing()) {
      findings.push_back({laser.is_missing() ? Verdict::kBad : Verdict::kAdvice, "sensors",
                          fmt::format("{} hears no {}: nothing on{}", printable(key.first),
                                      laser.is_missing() ? "laser" : "motion", silent),
                          advice});
    } else if (!silent.empty()) {
      findings.push_back({Verdict::kGood, "sensors",
                          fmt::format("{}: nothing on{}", printable(key.first), silent), ""});
    }
  }
}

void silence_findings(const Latest& latest, const std::vector<LocalProcess>& running,
                      std::vector<Finding>& findings) {
  std::set<std::int64_t> heard;
  for (const auto& [key, health] : latest) heard.insert(key.second);
  for (const LocalProcess& one : running) {
    if (heard.contains(one.pid)) continue;
    findings.push_back({Verdict::kBad, "processes",
                        fmt::format("{} (process {}) runs, but no HEALTH of it is heard",
                                    printable(one.program), one.pid),
                        fmt::format("it hangs, or is on another bus: tr '\\0' '\\n' < "
                                    "/proc/{}/environ | grep LCM; else kill {}",
                                    one.pid, one.pid)});
  }
}

}  // namespace

std::vector<LocalProcess> local_processes() {
  std::vector<LocalProcess> processes;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", failed)) {
    const std::string name = entry.path().filename().string();
    std::int64_t pid = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
    if (error != std::errc() || end != name.data() + name.size()) continue;
    std::error_code unreadable;
    const auto program = std::filesystem::read_symlink(entry.path() / "exe", unreadable);
    if (!unreadable && program.filename().string().starts_with("understory-"))
      processes.push_back({pid, program.filename().string()});
  }
  std::ranges::sort(processes, {}, &LocalProcess::pid);
  return processes;
}

std::vector<Finding> process_findings(const std::vector<health_t>& heard,
                                      const std::vector<LocalProcess>& running,
                                      const std::string& version) {
  Latest latest;
  for (const health_t& health : heard)
    latest.insert_or_assign({health.process, health.pid}, health);
  std::vector<Finding> findings;
  name_findings(latest, findings);
  version_findings(latest, version, findings);
  state_findings(latest, findings);
  silence_findings(latest, running, findings);
  loss_findings(latest, findings);
  buffer_findings(latest, findings);
  sensor_findings(latest, findings);

  const std::string text = latest.empty() && running.empty()
                               ? "none runs; while they do, this command looks at them, too"
                               : fmt::format("{} heard", latest.size());
  findings.insert(findings.begin(), {Verdict::kGood, "processes", text, ""});
  return findings;
}

}  // namespace understory::cli
