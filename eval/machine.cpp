#include "eval/machine.hpp"

#include <fstream>
#include <thread>

#include "understory_eval_version.hpp"

namespace understory::eval {

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

double resident_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::stod(line.substr(6)) / 1024.0;
  }
  return 0.0;
}

std::string version() { return UNDERSTORY_GIT_DESCRIBE; }

}  // namespace understory::eval
