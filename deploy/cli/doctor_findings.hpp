// What `understory doctor` looks at, and what it makes of it.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/bus/udpm_url.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {

/// How bad something is. kBad must be mended; kAdvice costs something or is for some only.
enum class Verdict : std::uint8_t { kGood, kAdvice, kBad };

/// One thing that was looked at.
struct Finding {
  Verdict verdict = Verdict::kGood;
  std::string subject;
  std::string text;
  std::string advice;  ///< The command that mends it, or what to do; empty where nothing.
};

/// A line each, the advice below it.
std::string findings_text(const std::vector<Finding>& findings);
/// `{ok, findings: [{verdict: "ok" | "advice" | "bad", subject, text, advice}]}`.
nlohmann::ordered_json findings_json(const std::vector<Finding>& findings);

/// The parts of an LCM URL: malformed, not multicast, or leaving this computer (TTL above 0).
std::vector<Finding> url_findings(const std::string& url);
/// Over which interface a group's packets go, by the text of /proc/net/route; `lo_flags` is the
/// text of /sys/class/net/lo/flags.
std::vector<Finding> route_findings(const bus::UdpmUrl& group, const std::string& routes,
                                    const std::string& lo_flags);
/// A message of our own, sent and received over the real socket; a port that another program keeps
/// for itself shows here, with its name. To be asked for both groups: that of sweeps is beside.
Finding multicast_finding(const std::string& url);

/// Processors, memory, the processors' governor.
std::vector<Finding> computer_findings();
/// Of the text of a scaling_governor; empty where the computer has none.
Finding governor_finding(const std::string& governor);
/// What the kernel grants as receive buffer.
Finding receive_buffer_finding();
/// Whether the clock is set and synchronised.
Finding clock_finding();
/// How far the clock jumped while `elapsed_us` passed by one that cannot.
Finding clock_jump_finding(std::int64_t elapsed_us, std::int64_t by_the_clock_us);
/// Whether state can be written into this directory (or made there), and how much room there is.
Finding state_finding(const std::string& directory);
/// Programs that debugging and pictures need.
std::vector<Finding> tool_findings();
/// The processes' programs beside the command: there, able to start, of this version.
std::vector<Finding> program_findings(const std::vector<std::string>& names,
                                      const std::string& version);

/// A process of ours on this computer.
struct LocalProcess {
  std::int64_t pid = 0;
  std::string program;  ///< e.g. understory-ekf
};
/// Those that run, by /proc.
std::vector<LocalProcess> local_processes();

/// All HEALTH that came in some seconds, and who runs: versions that differ, two of one name,
/// silent ones, bad states, lost messages, small buffers, sensors from which nothing comes.
std::vector<Finding> process_findings(const std::vector<health_t>& heard,
                                      const std::vector<LocalProcess>& running,
                                      const std::string& version);

}  // namespace understory::cli
