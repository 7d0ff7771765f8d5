// `understory import bag`: recordings of ROS, without ROS.
#pragma once

#include <CLI/CLI.hpp>

namespace understory::cli {

/// Adds bag.
void add_bag_import(CLI::App& import);

}  // namespace understory::cli
