// Worlds with a path through them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/forest.hpp"
#include "sim/forest_world.hpp"
#include "sim/path.hpp"
#include "sim/sensor_drive.hpp"

namespace understory::sim {

/// A forest and the path through it.
struct ForestScenarioParameters {
  ForestParameters forest =
      forest_parameters(ForestKind::kIntermediate);  ///< The side is set by the path.
  ForestWorldParameters world;
  PathKind path = PathKind::kCircle;
  double length_m = 1000.0;  ///< Of one lap.
  int laps = 1;              ///< More than one only for closed paths.
  double margin_m = 110.0;   ///< Forest around the path: the laser's range.
};
/// A simulated forest (GeoSLAM §4.5.2) with a path in its middle.
Scenario forest_scenario(const ForestScenarioParameters& parameters, std::uint64_t seed);
/// Likewise in a given forest, with the path's start at `world_T_start`.
Scenario forest_scenario(const ForestScenarioParameters& parameters, const Forest& forest,
                         const geometry::SE2& world_T_start, std::uint64_t seed);

/// One or more laps around a residential block, about 700 m each, closed (thesis on submaps, 3.1
/// and 5.1.1: *Urban*). One lap drives the first `overlap_m` a second time.
Scenario urban_scenario(int laps, std::uint64_t seed, double overlap_m = 60.0);
/// From the streets of the town to the fields (*Urban to Countryside*, *City to country*);
/// `length_m` of several km.
Scenario urban_to_countryside_scenario(double length_m, std::uint64_t seed);
/// Country roads: woods, avenues, fields, occasionally a village (*Countryside*).
Scenario countryside_scenario(double length_m, std::uint64_t seed);

/// A scenario from files, or the error.
struct ScenarioResult {
  std::optional<Scenario> scenario;
  std::string error;  ///< Empty if valid; else the error in the texts.
};
/// A real map of poles and trunks (CSV x_m,y_m[,dbh_m]) and the real path of a car among them (CSV
/// frame,x_m,y_m,yaw_rad; frames without number are allowed). Poles on the path are removed; thick
/// ones and half of those of unknown thickness are trees. Bushes, parked cars and people are added.
ScenarioResult pole_map_scenario(std::string_view poles_csv, std::string_view trajectory_csv,
                                 std::uint64_t seed);

}  // namespace understory::sim
