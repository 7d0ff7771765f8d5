// eval existence-camera: what is culling worth to a camera that comes back to an old map?
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::existence::camera {

/// Adds `existence-camera`: office, station and forest, mapped once, changed, driven through again.
void add_existence_camera_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::existence::camera
