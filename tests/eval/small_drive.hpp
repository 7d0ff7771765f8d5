// Short drives in a small sparse forest, for tests.
#pragma once

#include "eval/run.hpp"
#include "sim/drive.hpp"

inline understory::sim::DriveParameters small_drive_parameters(double length_m = 8.0) {
  understory::sim::DriveParameters parameters;
  parameters.forest = understory::sim::forest_parameters(understory::sim::ForestKind::kSparse);
  parameters.forest.side_m = 200.0;
  parameters.path.length_m = length_m;
  return parameters;
}
