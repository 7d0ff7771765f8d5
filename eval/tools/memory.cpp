#include "eval/tools/memory.hpp"

#include <fstream>
#include <string>

namespace understory::eval::tools {

double resident_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::stod(line.substr(6)) / 1024.0;
  }
  return 0.0;
}

}  // namespace understory::eval::tools
