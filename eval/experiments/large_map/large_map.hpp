// eval large-map (GeoSLAM §5.4): every keyframe localised on its own in a whole forest.
#pragma once

#include <CLI/App.hpp>

namespace understory::eval::experiments::large_map {

/// Adds `large-map`: the default forest, 80 % detection, the sparse and the dense forest, single
/// scans, and half of all points false; a larger forest with --side-km.
void add_large_map_experiment(CLI::App& eval);

}  // namespace understory::eval::experiments::large_map
