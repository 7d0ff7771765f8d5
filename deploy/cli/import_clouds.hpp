// `understory import clouds`: files with a cloud each as sweeps.
#pragma once

#include <CLI/CLI.hpp>

namespace understory::cli {

/// Adds the command.
void add_cloud_import(CLI::App& import);

}  // namespace understory::cli
