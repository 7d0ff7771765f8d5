// `understory import stem-frames`.
#pragma once

#include <CLI/App.hpp>

namespace understory::cli {

/// Adds `stem-frames`: a folder of detected stems, one table for each frame, with a trajectory.
void add_stem_frames_import(CLI::App& import);

}  // namespace understory::cli
