#include "services/viewer/process_watch.hpp"

#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

namespace understory::viewer {

ProcessSample look_at_process(std::int64_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  if (!file || !std::getline(file, text)) return {};
  // The name, in brackets, may itself contain spaces and brackets.
  const auto end = text.rfind(')');
  if (end == std::string::npos) return {};

  std::istringstream fields(text.substr(end + 1));
  std::string state;
  std::string skipped;
  double user = 0.0;
  double system = 0.0;
  fields >> state;
  for (int field = 4; field < 14; ++field) fields >> skipped;
  fields >> user >> system;
  if (!fields) return {};
  const double ticks = static_cast<double>(::sysconf(_SC_CLK_TCK));
  return {.is_running = state != "Z" && state != "X" && state != "T" && state != "t",
          .cpu_s = (user + system) / ticks};
}

}  // namespace understory::viewer
