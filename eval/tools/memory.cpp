#include "eval/tools/memory.hpp"

#include <malloc.h>

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

std::ptrdiff_t heap_in_use() {
  const struct mallinfo2 heap = mallinfo2();
  return static_cast<std::ptrdiff_t>(heap.uordblks + heap.hblkhd);
}

}  // namespace understory::eval::tools
