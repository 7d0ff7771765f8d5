// Worlds with a way through them, ready to be driven.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sim/forest.hpp"
#include "sim/forest_world.hpp"
#include "sim/path.hpp"
#include "sim/sensor_drive.hpp"

namespace understory::sim {

struct ForestScenarioParameters {
  ForestParameters forest = forest_parameters(ForestKind::kIntermediate);  ///< The side follows.
  ForestWorldParameters world;
  PathKind path = PathKind::kCircle;
  double length_m = 1000.0;  ///< Of one lap.
  int laps = 1;              ///< More than one only for paths that end where they began.
  double margin_m = 110.0;   ///< Forest around the way: what the laser can see.
};
/// A forest of the source's kind (GeoSLAM §4.5.2) with a path in its middle.
Scenario forest_scenario(const ForestScenarioParameters& parameters, std::uint64_t seed);
/// The same in a given forest, where the path's start is at `world_T_start`.
Scenario forest_scenario(const ForestScenarioParameters& parameters, const Forest& forest,
                         const SE2& world_T_start, std::uint64_t seed);

}  // namespace understory::sim
