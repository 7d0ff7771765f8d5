// What a person states about clouds of points.
#pragma once

#include <CLI/CLI.hpp>

#include "common/bag/cloud_decoder.hpp"

namespace understory::cli {

/// Adds --point-time and --max-range; `cloud` must outlive the command.
void add_cloud_options(CLI::App& command, bag::CloudOptions& cloud);

}  // namespace understory::cli
