// A short drive as the messages of a bus: every channel that common/foxglove takes.
#pragma once

#include <vector>

#include "common/io/lcm_log.hpp"

namespace understory::test {

/// 10 scans a second on a circle of 20 m among 60 landmarks, which the map gets one by one; some
/// are moved, merged, removed, handed over in a submap or taken for gone. Numbered events; receipt
/// is 20 ms after the stamp. The same for the same number of scans.
std::vector<io::LogEvent> synthetic_drive(int scans);

}  // namespace understory::test
