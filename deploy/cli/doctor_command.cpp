// `understory doctor`: checks this computer and lists what to do.
#include <fmt/format.h>
#include <lcm/lcm.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "common/bus/live_bus.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"

namespace understory::cli {
namespace {

enum class Verdict { kGood, kAdvice, kBad };

struct Finding {
  Verdict verdict = Verdict::kGood;
  std::string subject;
  std::string text;
  std::string advice;  ///< What to do; empty where nothing.
};

constexpr int kWantedBufferBytes = 4'194'304;

/// First line that a shell command prints; empty when it fails.
std::string first_line_of(const char* command) {
  std::FILE* pipe = ::popen(command, "r");  // NOLINT(cert-env33-c): fixed texts only.
  if (pipe == nullptr) return {};
  std::array<char, 256> line{};
  const bool got = std::fgets(line.data(), line.size(), pipe) != nullptr;
  const bool succeeded = ::pclose(pipe) == 0;
  std::string result = got && succeeded ? line.data() : "";
  while (!result.empty() && (result.back() == '\n' || result.back() == ' ')) result.pop_back();
  return result;
}

/// A message of our own, sent and received over the real socket.
Finding check_multicast(const std::string& url) {
  Finding finding{Verdict::kBad, "multicast", "",
                  "deploy/setup, or: ip link set lo multicast on; "
                  "ip route add 224.0.0.0/4 dev lo"};
  try {
    bus::LiveBus bus(url);
    const auto channel = fmt::format("DOCTOR_{}", ::getpid());
    bool heard = false;
    bus.subscribe(channel, 1, [&](const bus::BusMessage&) { heard = true; });
    const auto start = std::chrono::steady_clock::now();

    const std::array<std::uint8_t, 5> text{'h', 'e', 'l', 'l', 'o'};
    if (bus.publish(channel, text)) {
      finding.text = "a message cannot be sent";
      return finding;
    }

    for (int i = 0; i < 10 && !heard; ++i) bus.handle_one(100);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    finding.text = "a message to ourselves does not arrive";
    if (!heard) return finding;
    return {Verdict::kGood, "multicast",
            fmt::format("a message went round in {:.1f} ms", took.count()), ""};
  } catch (const bus::BusError& error) {
    finding.text = error.what();
    return finding;
  }
}

Finding check_receive_buffer() {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int granted = 0;
  socklen_t size = sizeof granted;
  ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &kWantedBufferBytes, sizeof kWantedBufferBytes);
  ::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  ::close(socket);
  granted /= 2;  // The kernel reports twice what it gives to data.

  if (granted >= kWantedBufferBytes) {
    return {Verdict::kGood, "receive buffer", fmt::format("{} bytes", granted), ""};
  }

  return {Verdict::kAdvice, "receive buffer",
          fmt::format("{} of {} bytes: bursts may be lost", granted, kWantedBufferBytes),
          "deploy/setup --tune"};
}

Finding check_clock() {
  timex clock{};
  const int state = ::adjtimex(&clock);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  // 2020-01-01: a machine that starts without a battery-backed clock believes it is 1970.
  if (now < std::chrono::seconds(1'577'836'800)) {
    return {Verdict::kAdvice, "clock", "before 2020", "set it: timedatectl set-ntp true"};
  }
  if (state == TIME_ERROR) {
    return {Verdict::kAdvice, "clock", "not synchronised (matters only between several computers)",
            "timedatectl set-ntp true"};
  }
  return {Verdict::kGood, "clock", "synchronised", ""};
}

Finding check_lcm() {
  return {Verdict::kGood, "lcm",
          fmt::format("{}.{}.{}", LCM_MAJOR_VERSION, LCM_MINOR_VERSION, LCM_MICRO_VERSION), ""};
}

Finding check_tool(const char* subject, const char* command, const char* advice) {
  const auto line = first_line_of(command);
  if (!line.empty()) return {Verdict::kGood, subject, line, ""};
  return {Verdict::kAdvice, subject, "not found", advice};
}

Finding check_jar() {
  const char* const jar = "/usr/share/java/lcm.jar";
  if (std::filesystem::exists(jar)) return {Verdict::kGood, "lcm.jar", jar, ""};
  return {Verdict::kAdvice, "lcm.jar", "not found (lcm-spy needs it)",
          "apt-get install liblcm-java"};
}

Finding check_processors() {
  const auto count = ::sysconf(_SC_NPROCESSORS_ONLN);
  const auto memory =
      static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  return {
      Verdict::kGood, "computer",
      fmt::format("{} processors, {:.1f} GiB of memory", count, memory / (1024.0 * 1024 * 1024)),
      ""};
}

void doctor(const std::string& url) {
  const Finding findings[] = {
      check_processors(),
      check_multicast(url),
      check_receive_buffer(),
      check_clock(),
      check_lcm(),
      check_tool("lcm-logger", "command -v lcm-logger", "apt-get install liblcm-bin"),
      check_tool("java", "java -version 2>&1", "apt-get install default-jdk (for deploy/spy only)"),
      check_tool("javac", "javac -version 2>&1",
                 "apt-get install default-jdk (for deploy/spy only)"),
      check_jar(),
      check_tool(
          "matplotlib",
          "/usr/bin/python3 -c 'import matplotlib; print(matplotlib.__version__)' 2>/dev/null",
          "apt-get install python3-matplotlib (for pictures only)"),
  };

  bool bad = false;
  for (const auto& finding : findings) {
    const char* const mark = finding.verdict == Verdict::kGood     ? "ok    "
                             : finding.verdict == Verdict::kAdvice ? "advice"
                                                                   : "BAD   ";
    fmt::print("{} {:<15} {}\n", mark, finding.subject, finding.text);
    if (!finding.advice.empty()) fmt::print("       {:<15} -> {}\n", "", finding.advice);
    bad = bad || finding.verdict == Verdict::kBad;
  }

  if (bad) fail("doctor: processes on this computer cannot hear each other");
}

}  // namespace

void add_doctor_command(CLI::App& parent) {
  auto* command = parent.add_subcommand("doctor", "Checks this computer and lists what to do");
  auto url = std::make_shared<std::string>();
  command->add_option("--lcm-url", *url, "Bus, e.g. udpm://239.255.76.67:7667?ttl=0");
  command->callback([url] { doctor(*url); });
}

}  // namespace understory::cli
