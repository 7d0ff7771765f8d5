// `understory doctor`: checks this computer and the processes on it, and lists remedies.
#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/bus/bulk_group.hpp"
#include "common/bus/launch_config.hpp"
#include "common/bus/service.hpp"
#include "common/model/program_version.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/doctor_findings.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/health_listener.hpp"
#include "deploy/cli/paths.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

using DoctorClock = std::chrono::steady_clock;

struct DoctorOptions {
  std::string lcm_url;
  std::filesystem::path state = default_state_directory();
  bool json = false;
};

const char* verdict_name(Verdict verdict) {
  return verdict == Verdict::kGood ? "ok" : verdict == Verdict::kAdvice ? "advice" : "bad";
}

std::size_t bad_ones(const std::vector<Finding>& findings) {
  return static_cast<std::size_t>(std::ranges::count(findings, Verdict::kBad, &Finding::verdict));
}

std::string whole_text(const char* path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The programs that the configuration launches.
std::vector<std::string> launched_programs() {
  std::vector<std::string> names;
  try {
    for (const auto& process : bus::read_launch_config(default_config_directory()).processes) {
      std::string name = "understory-" + process.name;
      std::ranges::replace(name, '_', '-');
      names.push_back(std::move(name));
    }
  } catch (const bus::ConfigurationError&) {
    // A directory without launch.toml launches nothing.
  }
  return names;
}

/// HEALTH of three seconds; it is published once a second.
std::vector<health_t> heard_health(const std::string& url) {
  std::vector<health_t> heard;
  HealthListener listener(url, [&](const health_t& health) { heard.push_back(health); });
  const auto end = DoctorClock::now() + std::chrono::milliseconds(2500);
  while (DoctorClock::now() < end) {
    terminal::throw_if_interrupted();
    listener.handle(std::chrono::milliseconds(100));
  }
  return heard;
}

std::int64_t microseconds(auto duration) {
  return std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
}

void look_at_bus(const std::string& url, std::vector<Finding>& findings) {
  const auto add = [&](std::vector<Finding> more) {
    findings.insert(findings.end(), std::make_move_iterator(more.begin()),
                    std::make_move_iterator(more.end()));
  };
  add(url_findings(url));
  if (bad_ones(findings) > 0) return;
  const std::string complete = bus::complete_lcm_url(url);
  add(route_findings(bus::parse_udpm_url(complete), whole_text("/proc/net/route"),
                     whole_text("/sys/class/net/lo/flags")));
  findings.push_back(multicast_finding(complete));
  if (findings.back().verdict == Verdict::kBad) return;
  findings.push_back(multicast_finding(bus::bulk_lcm_url(complete)));
  findings.back().subject = "multicast of sweeps";

  const auto start = DoctorClock::now();
  const auto start_by_clock = std::chrono::system_clock::now();
  const std::vector<health_t> heard = heard_health(url);
  findings.push_back(
      clock_jump_finding(microseconds(DoctorClock::now() - start),
                         microseconds(std::chrono::system_clock::now() - start_by_clock)));
  add(process_findings(heard, local_processes(), model::program_version()));
}

void doctor(const DoctorOptions& options) {
  terminal::catch_interrupts();
  std::vector<Finding> findings = computer_findings();
  findings.push_back(receive_buffer_finding());
  findings.push_back(clock_finding());
  findings.push_back(state_finding(options.state.string()));
  for (Finding& one : program_findings(launched_programs(), model::program_version()))
    findings.push_back(std::move(one));
  for (Finding& one : tool_findings()) findings.push_back(std::move(one));
  std::vector<Finding> bus;
  look_at_bus(options.lcm_url, bus);
  findings.insert(findings.begin(), bus.begin(), bus.end());

  fmt::print("{}", options.json ? result_text(findings_json(findings), 2) + "\n"
                                : findings_text(findings));
  const std::size_t bad = bad_ones(findings);
  if (bad > 0) fail(fmt::format("doctor: {} to be mended", bad));
}

}  // namespace

std::string findings_text(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& one : findings) {
    const char* const mark = one.verdict == Verdict::kBad ? "BAD" : verdict_name(one.verdict);
    fmt::format_to(std::back_inserter(text), "{:<6} {:<15} {}\n", mark, one.subject,
                   terminal::printable(one.text));
    if (!one.advice.empty())
      fmt::format_to(std::back_inserter(text), "       {:<15} -> {}\n", "", one.advice);
  }
  return text;
}

nlohmann::ordered_json findings_json(const std::vector<Finding>& findings) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Finding& one : findings) {
    list.push_back({{"verdict", verdict_name(one.verdict)},
                    {"subject", one.subject},
                    {"text", one.text},
                    {"advice", one.advice}});
  }
  return {{"ok", bad_ones(findings) == 0}, {"findings", list}};
}

void add_doctor_command(CLI::App& parent) {
  auto* command = parent.add_subcommand("doctor", "Checks this computer and lists what to do");
  auto options = std::make_shared<DoctorOptions>();
  command->add_option("--lcm-url", options->lcm_url, "Bus, e.g. udpm://239.255.76.67:7667?ttl=0");
  command->add_option("--state-dir", options->state, "Directory of the processes' state")
      ->capture_default_str();
  command->add_flag("--json", options->json, "As JSON");
  command->callback([options] { doctor(*options); });
}

}  // namespace understory::cli
