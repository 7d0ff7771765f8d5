#include "sim/reflectivity.hpp"

#include <algorithm>

#include "sim/hash_random.hpp"

namespace understory::sim {
namespace {

struct Surface {
  double reflectivity;
  double least_cosine;
};

Surface surface_of(ObjectClass kind) {
  switch (kind) {
    case ObjectClass::kGround:
      return {0.25, 0.12};
    case ObjectClass::kTrunk:
      return {0.30, 0.15};
    case ObjectClass::kPole:
      return {0.45, 0.05};
    case ObjectClass::kBranch:
      return {0.25, 0.3};
    case ObjectClass::kCrown:
    case ObjectClass::kBush:
      return {0.40, 0.3};
    case ObjectClass::kWall:
      return {0.45, 0.05};
    case ObjectClass::kCar:
      return {0.25, 0.05};
    case ObjectClass::kPerson:
      return {0.35, 0.2};
    case ObjectClass::kFurniture:
      return {0.40, 0.1};
  }

  return {0.3, 0.1};
}

}  // namespace

Reflection reflection_of(const World& world, const RayHit& hit) {
  const Surface surface = surface_of(world.kind(hit.object));
  const double shade = 0.6 + 0.8 * uniform_of(mixed(world.key(hit.object)));
  return {std::min(1.0, surface.reflectivity * shade), std::max(hit.cosine, surface.least_cosine)};
}

}  // namespace understory::sim
