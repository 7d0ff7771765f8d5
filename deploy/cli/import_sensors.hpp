// `understory import` for recordings with a laser that scans in space, and for tables.
#pragma once

#include <CLI/CLI.hpp>

namespace understory::cli {

/// Adds kitti, kitti-reduced and csv.
void add_sensor_imports(CLI::App& import);

}  // namespace understory::cli
