// eval place-recognition: frames of stems found again, within a drive and between drives.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::place_recognition {

/// Adds `place-recognition`: drives that are given as folders (common/io/stem_frames.hpp).
void add_place_recognition_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::place_recognition
