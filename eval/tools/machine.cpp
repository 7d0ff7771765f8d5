#include "eval/tools/machine.hpp"

#include <ctime>
#include <fstream>
#include <thread>

#include "understory_eval_version.hpp"

namespace understory::eval::tools {

Machine this_machine() {
  Machine machine{"unknown", std::thread::hardware_concurrency()};
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(": ");
    if (line.rfind("model name", 0) != 0 || colon == std::string::npos) continue;
    machine.cpu = line.substr(colon + 2);
    break;
  }
  return machine;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[sizeof "YYYY-MM-DD"] = "";
  std::strftime(text, sizeof text, "%F", &utc);
  return text;
}

std::string version() { return UNDERSTORY_GIT_DESCRIBE; }

}  // namespace understory::eval::tools
