#include "deploy/cli/launch_report.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "common/terminal/printable.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

std::string time_of_day() {
  const auto now = std::chrono::system_clock::now();
  const auto since_epoch = now.time_since_epoch();
  const auto part =
      std::chrono::duration_cast<std::chrono::milliseconds>(since_epoch).count() % 1000;
  return fmt::format("{:%H:%M:%S}.{:03}", fmt::localtime(std::chrono::system_clock::to_time_t(now)),
                     part);
}

}  // namespace

void LaunchReport::add(const std::string& process, const std::string& text) {
  const auto time = time_of_day();
  if (!quiet_) {
    fmt::print("{} {}: {}\n", time, terminal::printable(process), terminal::printable(text));
    std::fflush(stdout);
  }
  if (events_.size() < kMaxEvents) events_.push_back({time, process, text});
}

void LaunchReport::add(const health_t& health) {
  std::string says = "HEALTH OK";
  switch (health.state) {
    case health_t::STATE_DEGRADED:
    case health_t::STATE_ERROR:
      says =
          fmt::format("HEALTH {} {}", health.state == health_t::STATE_ERROR ? "ERROR" : "DEGRADED",
                      health.last_error_code);
      break;
    case health_t::STATE_OK:
      break;
    default:
      return;  // The supervisor reports starts and stops.
  }

  if (latest_.size() >= kMaxProcesses && !latest_.contains(health.process)) return;

  // A process counts as OK until it reports a fault; the text of the first message of a kind is
  // printed.
  std::string& latest = latest_.try_emplace(health.process, "HEALTH OK").first->second;
  if (says == latest) return;
  latest = says;
  add(health.process, health.state == health_t::STATE_OK ? says : says + ": " + health.last_error);
}

void LaunchReport::write(const std::filesystem::path& file,
                         const std::vector<launch::ProcessStatus>& processes) const {
  nlohmann::ordered_json report;
  report["processes"] = nlohmann::ordered_json::array();
  for (const auto& process : processes) {
    report["processes"].push_back({{"name", process.name},
                                   {"state", launch::to_string(process.state)},
                                   {"pid", process.pid},
                                   {"restarts", process.restarts},
                                   {"last_ending", process.last_ending}});
  }

  report["events"] = nlohmann::ordered_json::array();
  for (const auto& event : events_) {
    report["events"].push_back(
        {{"time", event.time}, {"process", event.process}, {"text", event.text}});
  }

  write_text_file(file, result_text(report, 2) + "\n");
}

}  // namespace understory::cli
