// Reflectivity of surfaces.
#pragma once

#include "sim/ray_caster.hpp"
#include "sim/world.hpp"

namespace understory::sim {

/// Reflection of the laser's light by a surface.
struct Reflection {
  double reflectivity = 0.0;  ///< Share of the light, in (0, 1].
  /// Of the angle of incidence, with a lower bound for rough surfaces (grass, bark).
  double cosine = 1.0;
};

/// Reflection at a hit. Each object has its own reflectivity, distributed around that of its class.
Reflection reflection_of(const World& world, const RayHit& hit);

}  // namespace understory::sim
