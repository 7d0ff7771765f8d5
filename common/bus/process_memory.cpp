#include "common/bus/process_memory.hpp"

#include <malloc.h>

namespace understory::bus {

void keep_freed_memory() {
  constexpr int kBytes = 64 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kBytes);
  ::mallopt(M_TRIM_THRESHOLD, 2 * kBytes);
}

}  // namespace understory::bus
