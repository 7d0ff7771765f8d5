// How much light surfaces send back.
#pragma once

#include "sim/ray_caster.hpp"
#include "sim/world.hpp"

namespace understory::sim {

/// How strongly a surface returns the laser's light.
struct Reflection {
  double reflectivity = 0.0;  ///< Share of the light, in (0, 1].
  /// Of the angle of incidence, not less than what rough surfaces (grass, bark) make of it.
  double cosine = 1.0;
};

/// Reflection at a hit. Each object has its own reflectivity, spread around that of its class.
Reflection reflection_of(const World& world, const RayHit& hit);

}  // namespace understory::sim
