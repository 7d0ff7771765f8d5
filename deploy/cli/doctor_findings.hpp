// The checks of `understory doctor` and their findings.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/bus/udpm_url.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {

/// Severity of a finding. kBad must be corrected; kAdvice is a disadvantage, or applies to some
/// users only.
enum class Verdict : std::uint8_t { kGood, kAdvice, kBad };

/// The result of one check.
struct Finding {
  Verdict verdict = Verdict::kGood;
  std::string subject;
  std::string text;
  std::string advice;  ///< The command or action that corrects it; empty = none.
};

/// One line for each finding, with its advice below.
std::string findings_text(const std::vector<Finding>& findings);
/// `{ok, findings: [{verdict: "ok" | "advice" | "bad", subject, text, advice}]}`.
nlohmann::ordered_json findings_json(const std::vector<Finding>& findings);

/// Checks an LCM URL: malformed, not multicast, or leaving this computer (TTL above 0).
std::vector<Finding> url_findings(const std::string& url);
/// Finds the interface of a group's packets in the text of /proc/net/route; `lo_flags` is the text
/// of /sys/class/net/lo/flags.
std::vector<Finding> route_findings(const bus::UdpmUrl& group, const std::string& routes,
                                    const std::string& lo_flags);
/// Sends and receives an own message over the real socket; reports a port that another program has
/// exclusively, with its name. Call it for both groups, also that of sweeps.
Finding multicast_finding(const std::string& url);

/// Checks processors, memory and the processors' governor.
std::vector<Finding> computer_findings();
/// Finding from the text of a scaling_governor; empty if the computer has none.
Finding governor_finding(const std::string& governor);
/// Checks the receive buffer granted by the kernel.
Finding receive_buffer_finding();
/// Checks that the clock is set and synchronised.
Finding clock_finding();
/// Finds a jump of the clock while `elapsed_us` passed on a monotonic clock.
Finding clock_jump_finding(std::int64_t elapsed_us, std::int64_t by_the_clock_us);
/// Checks that state can be written into this directory (created if missing), and its free space.
Finding state_finding(const std::string& directory);
/// Checks the programs needed for debugging and pictures.
std::vector<Finding> tool_findings();
/// Checks the processes' programs beside the command: present, able to start, of this version.
std::vector<Finding> program_findings(const std::vector<std::string>& names,
                                      const std::string& version);

/// An Understory process on this computer.
struct LocalProcess {
  std::int64_t pid = 0;
  std::string program;  ///< e.g. understory-ekf
};
/// The running processes, from /proc.
std::vector<LocalProcess> local_processes();

/// Findings from the HEALTH messages of some seconds and the running processes: different versions,
/// duplicate names, silent processes, bad states, lost messages, small buffers, silent sensors.
std::vector<Finding> process_findings(const std::vector<health_t>& heard,
                                      const std::vector<LocalProcess>& running,
                                      const std::string& version);

}  // namespace understory::cli
