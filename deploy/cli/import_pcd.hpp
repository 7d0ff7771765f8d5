// `understory import pcd`: PCD files as sweeps.
#pragma once

#include <CLI/CLI.hpp>

namespace understory::cli {

/// Adds the command.
void add_pcd_import(CLI::App& import);

}  // namespace understory::cli
