// Short drives in a small sparse forest, for tests.
#pragma once

#include "eval/harness/run.hpp"
#include "sim/drive.hpp"

namespace understory::test {

/// A drive of that length [m] through 200 m x 200 m of sparse forest.
inline sim::DriveParameters small_drive_parameters(double length_m = 8.0) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kSparse);
  parameters.forest.side_m = 200.0;
  parameters.path.length_m = length_m;
  return parameters;
}

}  // namespace understory::test
