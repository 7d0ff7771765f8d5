// Options of simulated detectors of landmarks: field of view, common errors of detections.
#pragma once

#include <CLI/App.hpp>

#include "sim/shared_errors.hpp"

namespace understory::cli {

/// Adds --view-deg, the width of the field of view, centred ahead. `view_rad` must outlive the
/// command.
void add_view_option(CLI::App& command, double& view_rad);

/// Adds the options of `shared` to a command that simulates detections of landmarks, in an own
/// group. `shared` must outlive the command.
void add_shared_error_options(CLI::App& command, sim::SharedErrorParameters& shared);

}  // namespace understory::cli
