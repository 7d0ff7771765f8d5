#include <fmt/format.h>
#include <lcm/lcm.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "deploy/cli/doctor_findings.hpp"
#include "deploy/cli/paths.hpp"
#include "services/viewer/page_bundle.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kWantedBufferBytes = 4'194'304;

/// First line that a shell command prints; empty when it fails.
std::string first_line_of(const std::string& command) {
  std::FILE* pipe = ::popen(command.c_str(), "r");  // NOLINT(cert-env33-c): texts of our own only.
  if (pipe == nullptr) return {};
  std::array<char, 256> line{};
  const bool got = std::fgets(line.data(), line.size(), pipe) != nullptr;
  const bool succeeded = ::pclose(pipe) == 0;
  std::string result = got && succeeded ? line.data() : "";
  while (!result.empty() && (result.back() == '\n' || result.back() == ' ')) result.pop_back();
  return result;
}

std::string first_line_in(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

Finding tool_finding(const char* subject, const char* command, const char* advice) {
  const auto line = first_line_of(command);
  if (!line.empty()) return {Verdict::kGood, subject, line, ""};
  return {Verdict::kAdvice, subject, "not found", advice};
}

/// The directory or, if it does not exist, its nearest existing parent.
fs::path nearest_existing(fs::path path) {
  std::error_code ignored;
  while (!path.empty() && !fs::exists(path, ignored) && path != path.parent_path())
    path = path.parent_path();
  return path.empty() ? fs::path(".") : path;
}

std::string quoted(const std::string& path) {
  std::string text(1, '\'');
  for (const char c : path) {
    if (c == '\'') {
      text += "'\\''";
    } else {
      text += c;
    }
  }
  text += '\'';
  return text;
}

}  // namespace

std::vector<Finding> computer_findings() {
  const auto count = ::sysconf(_SC_NPROCESSORS_ONLN);
  const auto memory =
      static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  Finding computer{
      Verdict::kGood, "computer",
      fmt::format("{} processors, {:.1f} GiB of memory", count, memory / (1024.0 * 1024 * 1024)),
      ""};
  if (count < 2) {
    computer.verdict = Verdict::kAdvice;
    computer.advice =
        "with one processor scans wait for each other: leave stages out (launch.toml)";
  }
  return {computer,
          governor_finding(first_line_in("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"))};
}

Finding governor_finding(const std::string& governor) {
  if (governor == "powersave") {
    return {Verdict::kAdvice, "governor", "powersave: processors stay slow, scans come late",
            "cpupower frequency-set -g performance (or schedutil)"};
  }
  return {Verdict::kGood, "governor", governor.empty() ? "none to be set" : governor, ""};
}

Finding receive_buffer_finding() {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int granted = 0;
  socklen_t size = sizeof granted;
  ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &kWantedBufferBytes, sizeof kWantedBufferBytes);
  ::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  ::close(socket);
  granted /= 2;  // The kernel reports twice the size for data.

  if (granted >= kWantedBufferBytes)
    return {Verdict::kGood, "receive buffer", fmt::format("{} bytes", granted), ""};
  return {
      Verdict::kAdvice, "receive buffer",
      fmt::format("{} of {} bytes: bursts may be lost", granted, kWantedBufferBytes),
      fmt::format("deploy/setup --tune, or: sysctl -w net.core.rmem_max={}", kWantedBufferBytes)};
}

Finding clock_finding() {
  timex clock{};
  const int state = ::adjtimex(&clock);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  // 2020-01-01: a machine without a battery-backed clock starts in 1970.
  if (now < std::chrono::seconds(1'577'836'800)) {
    return {Verdict::kAdvice, "clock", "before 2020", "set it: timedatectl set-ntp true"};
  }
  if (state == TIME_ERROR) {
    return {Verdict::kAdvice, "clock", "not synchronised (matters only between several computers)",
            "timedatectl set-ntp true"};
  }
  return {Verdict::kGood, "clock", "synchronised", ""};
}

Finding clock_jump_finding(std::int64_t elapsed_us, std::int64_t by_the_clock_us) {
  constexpr std::int64_t kJumpUs = 50'000;
  const std::int64_t jump_us = by_the_clock_us - elapsed_us;
  if (std::abs(jump_us) < kJumpUs)
    return {Verdict::kGood, "clock steps", "none while this command listened", ""};
  return {
      Verdict::kBad, "clock steps",
      fmt::format("the clock jumped by {:.3f} s while this command listened: stamps of sensors "
                  "jump with it",
                  1e-6 * static_cast<double>(jump_us)),
      "let one program alone set it, without steps while driving: timedatectl; chronyc tracking"};
}

Finding state_finding(const std::string& directory) {
  constexpr double kBadBytes = 100e6;
  constexpr double kAdviceBytes = 2e9;
  const fs::path nearest = nearest_existing(directory);
  if (!fs::is_directory(nearest) || ::access(nearest.c_str(), W_OK | X_OK) != 0) {
    return {Verdict::kBad, "state", directory + ": cannot be written: state and maps are lost",
            fmt::format("chown $USER {}, or set UNDERSTORY_STATE", quoted(nearest.string()))};
  }

  std::error_code failed;
  const fs::space_info space = fs::space(nearest, failed);
  const auto left = failed ? kAdviceBytes : static_cast<double>(space.available);
  const std::string text = fmt::format("{}: {:.1f} GB left", directory, 1e-9 * left);
  if (left < kBadBytes) {
    return {Verdict::kBad, "state", text + ": state and maps are not kept when it is full",
            "make room, or set UNDERSTORY_STATE to another disk"};
  }
  if (left < kAdviceBytes) {
    return {Verdict::kAdvice, "state", text + ": a recording with sweeps takes 30 GB an hour",
            "make room, or record to another disk"};
  }
  return {Verdict::kGood, "state", text, ""};
}

std::vector<Finding> tool_findings() {
  const char* const jar = "/usr/share/java/lcm.jar";
  const bool has_jar = fs::exists(jar);
  return {
      {Verdict::kGood, "lcm",
       fmt::format("{}.{}.{}", LCM_MAJOR_VERSION, LCM_MINOR_VERSION, LCM_MICRO_VERSION), ""},
      tool_finding("lcm-logger", "command -v lcm-logger", "apt-get install liblcm-bin"),
      tool_finding("java", "java -version 2>&1",
                   "apt-get install default-jdk (for deploy/spy only)"),
      tool_finding("javac", "javac -version 2>&1",
                   "apt-get install default-jdk (for deploy/spy only)"),
      {has_jar ? Verdict::kGood : Verdict::kAdvice, "lcm.jar",
       has_jar ? jar : "not found (lcm-spy needs it)",
       has_jar ? "" : "apt-get install liblcm-java"},
      tool_finding(
          "matplotlib",
          "/usr/bin/python3 -c 'import matplotlib; print(matplotlib.__version__)' 2>/dev/null",
          "apt-get install python3-matplotlib (for pictures only)"),
      {viewer::has_page() ? Verdict::kGood : Verdict::kAdvice, "page",
       viewer::has_page() ? "part of the program" : "the viewer's page was not built",
       viewer::has_page() ? "" : "deploy/setup (node, npm), then build again with a network"},
  };
}

std::vector<Finding> program_findings(const std::vector<std::string>& names,
                                      const std::string& version) {
  std::vector<Finding> findings;
  std::string missing;
  for (const std::string& name : names) {
    const std::string path = find_executable(name);
    if (!fs::exists(path) && first_line_of("command -v " + quoted(name)).empty()) {
      missing += fmt::format(" {}", name);
      continue;
    }
    const std::string line = first_line_of(quoted(path) + " --version 2>/dev/null");
    if (line.empty()) {
      findings.push_back(
          {Verdict::kBad, "programs", path + ": does not start",
           fmt::format("ldd {} (what is not found there: deploy/setup)", quoted(path))});
    } else if (line.find(version) == std::string::npos) {
      findings.push_back({Verdict::kBad, "programs",
                          fmt::format("{}: version {}, the command is {}", path, line, version),
                          "build or install all of them anew"});
    }
  }

  if (!missing.empty()) {
    findings.push_back({Verdict::kAdvice, "programs", "not built or not installed:" + missing,
                        "ninja -C build/release"});
  }
  if (findings.empty())
    findings.push_back({Verdict::kGood, "programs", fmt::format("{} of them", names.size()), ""});
  return findings;
}

}  // namespace understory::cli
