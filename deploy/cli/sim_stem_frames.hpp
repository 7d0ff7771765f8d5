// `understory sim stem-frames`.
#pragma once

#include <CLI/App.hpp>

namespace understory::cli {

/// Adds `stem-frames`: a drive through a surveyed forest as a folder of detected stems.
void add_stem_frames_simulation(CLI::App& sim);

}  // namespace understory::cli
