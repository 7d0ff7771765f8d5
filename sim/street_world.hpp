// Streets, gardens and fields along a route: houses, cars, poles, trees, bushes, people.
#pragma once

#include <Eigen/Core>
#include <random>
#include <span>
#include <vector>

#include "sim/forest_world.hpp"
#include "sim/route.hpp"
#include "sim/world.hpp"

namespace understory::sim {

/// Objects along a stretch of the route; numbers are means per 100 m, both sides together.
struct Roadside {
  double houses = 0.0;
  double cars = 0.0;   ///< Parked.
  double poles = 0.0;  ///< Lamps and signs, near the route.
  double trees = 0.0;  ///< In gardens and along the route.
  double bushes = 0.0;
  double people = 0.0;
  double wood_trees = 0.0;  ///< In a wood slightly off the route, on one side.
};
Roadside town_roadside();     ///< Houses, parked cars, lamps, gardens.
Roadside avenue_roadside();   ///< Trees and delineators along a country road.
Roadside field_roadside();    ///< Almost nothing.
Roadside wood_roadside();     ///< A wood on one side.
Roadside village_roadside();  ///< A few houses and their gardens.

/// A part of the route and its roadside.
struct Stretch {
  double length_m = 100.0;
  Roadside roadside;
};

/// Frame `world`; the route is the middle of the driven lane.
struct StreetWorldParameters {
  GroundParameters ground{
      .slope = {0.004, -0.006}, .relief_m = 0.15, .roughness_m = 0.006, .cover_m = 0.005};
  ForestWorldParameters plants;   ///< Shapes of trees.
  double house_distance_m = 9.0;  ///< Least, from the route to a house.
  double clearance_m = 2.2;       ///< Least distance of objects from the route.
};

/// A world along `route`; the last stretch continues to its end. No house is placed on another part
/// of the route, nor in another house.
World make_street_world(const Route& route, std::span<const Stretch> stretches,
                        const StreetWorldParameters& parameters, std::mt19937_64& random);

/// The given poles, those of unknown radius half of them trees (as are those thicker than 0.12 m),
/// with parked cars, bushes and people along `route`. Poles nearer to the route than the clearance
/// are removed.
World make_pole_world(const Route& route, const Forest& poles,
                      const StreetWorldParameters& parameters, std::mt19937_64& random);

}  // namespace understory::sim
