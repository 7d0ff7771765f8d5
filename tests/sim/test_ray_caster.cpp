#include <cmath>
#include <numbers>
#include <random>

#include "sim/ray_caster.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;
using namespace understory::sim;
using std::numbers::pi;

namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

GroundParameters rough_ground() {
  return {.slope = {0.05, -0.04}, .relief_m = 0.6, .roughness_m = 0.03, .cover_m = 0.02};
}

/// Some of everything, far enough from the origin that it is in the open.
World cluttered_world(Random& random) {
  World world(Ground(rough_ground(), random));
  for (int i = 0; i < 400; ++i) {
    const double range = uniform(random, 3.0, 90.0);
    const double bearing = uniform(random, -pi, pi);
    const Eigen::Vector2d at = range * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    const double ground = world.ground().height(at);

    switch (i % 5) {
      case 0:
        world.add_trunk(ObjectClass::kTrunk, at, uniform(random, 0.05, 0.5), 12.0, 0.004,
                        {uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1)});
        break;
      case 1:
        world.add(ObjectClass::kCrown, Foliage{{at.x(), at.y(), ground + 6.0}, 2.5, 3.0, 0.4});
        break;
      case 2:
        world.add(ObjectClass::kCar,
                  Box{{at.x(), at.y(), ground + 0.8}, {2.2, 0.9, 0.8}, uniform(random, -pi, pi)});
        break;
      case 3:
        world.add(ObjectClass::kWall,
                  Wall{at, at + Eigen::Vector2d(uniform(random, -9, 9), uniform(random, -9, 9)),
                       ground - 1.0, ground + 5.0});
        break;
      default:
        world.add(Walker{{at.x(), at.y(), ground}, {1.0, 1.0}, 1.2, uniform(random, -pi, pi)});
    }
  }

  return world;
}

/// One ray against every object, in order.
RayHit cast_at_all(const World& world, const Ray& ray, double time_s, double max_m,
                   std::uint64_t luck) {
  RayHit hit{max_m, 0.0, kGroundObject, false};
  for (ObjectId i = 0; i < world.object_count(); ++i) {
    const auto met = world.meet_object(ray, i, time_s, luck);
    if (met && met->range_m < hit.range_m) hit = {met->range_m, met->cosine, i, true};
  }
  const auto ground = world.meet_ground(ray, hit.range_m, luck);
  if (ground) hit = {ground->range_m, ground->cosine, kGroundObject, true};
  return hit;
}

Eigen::Vector3d direction_of(double bearing, double elevation) {
  return {std::cos(elevation) * std::cos(bearing), std::cos(elevation) * std::sin(bearing),
          std::sin(elevation)};
}

}  // namespace

TEST_CASE("A fan of rays meets what brute force over all objects meets", "[caster]") {
  Random random(GENERATE(1, 2));
  const World world = cluttered_world(random);
  RayCaster caster(world);
  const Eigen::Vector3d origin(0.3, -0.4, world.ground().height({0.3, -0.4}) + 1.9);
  int hits_on_objects = 0;

  for (int fan = 0; fan < 500; ++fan) {
    const double bearing = uniform(random, -pi, pi);
    const double spread = fan % 2 == 0 ? 0.02 : 0.0;

    // Some fans are too wide for a sector and must be cast ray by ray.
    const double spread_or_wide = fan % 10 == 9 ? 2.0 : spread;
    std::vector<Eigen::Vector3d> directions;
    for (int i = 0; i < 16; ++i) {
      directions.push_back(direction_of(bearing + uniform(random, -spread_or_wide, spread_or_wide),
                                        uniform(random, -0.5, 0.5)));
    }

    std::vector<RayHit> hits(directions.size());
    const double time_s = 0.1 * fan;
    caster.cast(origin, directions, time_s, 100.0, fan, hits);

    for (std::size_t i = 0; i < directions.size(); ++i) {
      const std::uint64_t luck = RayCaster::luck_of_ray(fan, i);
      const RayHit expected = cast_at_all(world, {origin, directions[i]}, time_s, 100.0, luck);
      REQUIRE(hits[i].is_hit == expected.is_hit);
      if (!expected.is_hit) continue;
      REQUIRE(hits[i].object == expected.object);
      REQUIRE(hits[i].range_m == expected.range_m);
      if (hits[i].object != kGroundObject) ++hits_on_objects;
    }
  }

  CHECK(hits_on_objects > 1000);
}

TEST_CASE("Rays end on the ground at the height field", "[ground]") {
  Random random(3);
  const Ground ground(rough_ground(), random);
  int below_horizon = 0;

  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d at(uniform(random, -2000, 2000), uniform(random, -2000, 2000));
    Eigen::Vector3d origin;
    origin << at, ground.height(at) + uniform(random, 0.5, 3.0);
    const Eigen::Vector3d direction =
        direction_of(uniform(random, -pi, pi), uniform(random, -1.5, 0.2));
    const auto hit = ground.cast(origin, direction, 120.0);

    // The first place on a fine search along the ray.
    double expected = 120.0;
    for (double t = 0.0; t < 120.0; t += 0.02) {
      const Eigen::Vector3d p = origin + t * direction;
      if (p.z() < ground.height(p.head<2>())) {
        expected = t;
        break;
      }
    }

    if (!hit) {
      // Only where the ray is missed by a hair.
      const Eigen::Vector3d p = origin + expected * direction;
      CHECK((expected > 119.0 || p.z() - ground.height(p.head<2>()) > -0.01));
      continue;
    }

    ++below_horizon;
    const Eigen::Vector3d p = origin + hit->range_m * direction;
    CHECK(std::abs(p.z() - ground.height(p.head<2>())) < 0.008);
    CHECK(std::abs(hit->cosine - std::abs(direction.dot(ground.normal(p.head<2>())))) < 0.03);

    // No earlier crossing deeper than the table's error.
    for (double t = 0.0; t < hit->range_m - 0.3; t += 0.05) {
      const Eigen::Vector3d q = origin + t * direction;
      REQUIRE(q.z() - ground.height(q.head<2>()) > -0.02);
    }
  }

  CHECK(below_horizon > 200);
}

TEST_CASE("The ground has the slope and the unevenness that were asked for", "[ground]") {
  Random random(4);
  const Ground ground(rough_ground(), random);
  double sum = 0.0;
  double squares = 0.0;
  const int n = 20000;

  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d at(uniform(random, 0, 256), uniform(random, 0, 256));
    const double above_plane = ground.height(at) - Eigen::Vector2d(0.05, -0.04).dot(at);
    sum += above_plane;
    squares += above_plane * above_plane;
    const double h = 1e-4;
    const Eigen::Vector2d numeric(
        (ground.height(at + Eigen::Vector2d(h, 0)) - ground.height(at - Eigen::Vector2d(h, 0))) /
            (2 * h),
        (ground.height(at + Eigen::Vector2d(0, h)) - ground.height(at - Eigen::Vector2d(0, h))) /
            (2 * h));
    REQUIRE((numeric - ground.gradient(at)).norm() < 2e-9);
  }

  CHECK(std::abs(sum / n) < 0.008);
  CHECK(std::sqrt(squares / n) == Approx(std::hypot(0.6, 0.03)).epsilon(0.1));
}

TEST_CASE("Surface hits lie on the surface, and nothing of it is nearer", "[shapes]") {
  Random random(5);
  int stems = 0;
  for (int i = 0; i < 20000; ++i) {
    Stem stem;
    stem.axis =
        Eigen::Vector3d(uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3), 1.0).normalized();
    stem.base_radius_m = uniform(random, 0.05, 0.5);
    stem.length_m = uniform(random, 2.0, 15.0);
    stem.taper = uniform(random, 0.0, 0.9) * stem.base_radius_m / stem.length_m;
    const Ray ray{{uniform(random, -8, 8), uniform(random, -8, 8), uniform(random, 0, 4)},
                  direction_of(uniform(random, -pi, pi), uniform(random, -1, 1))};
    const auto hit = meet(ray, stem);

    // Distance to the surface along the ray, by sampling: negative inside.
    const auto depth = [&](double t) {
      const Eigen::Vector3d p = ray.origin_m + t * ray.direction - stem.base_m;
      const double along = p.dot(stem.axis);
      if (along < 0.0 || along > stem.length_m) return 1.0;
      return (p - along * stem.axis).norm() - stem.radius_at(along);
    };

    if (hit) {
      ++stems;
      CHECK(std::abs(depth(hit->range_m)) < 1e-9);
      CHECK(hit->cosine >= 0.0);
      CHECK(hit->cosine <= 1.0);
    }

    if (i % 20 == 0 && depth(0.0) > 0.0) {
      const double until = hit ? hit->range_m - 1e-6 : 20.0;

      // A ray that gets into the stem without touching it came in through an open end.
      bool through_end = false;
      for (double t = 0.0; t < until && !through_end; t += 0.01) through_end = depth(t) < 0.0;
      if (through_end) {
        const double low = (ray.origin_m - stem.base_m).dot(stem.axis);
        const double climb = ray.direction.dot(stem.axis);
        const double to_end = ((climb > 0.0 ? 0.0 : stem.length_m) - low) / climb;
        const Eigen::Vector3d p = ray.origin_m + to_end * ray.direction - stem.base_m;
        const double end = climb > 0.0 ? 0.0 : stem.length_m;
        CHECK((p - end * stem.axis).norm() <= stem.radius_at(end) + 1e-6);
      }
    }
  }

  CHECK(stems > 200);
}

TEST_CASE("What covers the ground stops rays at the height that was asked for", "[ground]") {
  Random random(7);
  const World world(Ground(GroundParameters{.cover_m = 0.05}, random));
  double sum = 0.0;
  const int n = 5000;

  for (int i = 0; i < n; ++i) {
    const Ray ray{{0.0, 0.0, 2.0}, direction_of(uniform(random, -pi, pi), -0.6)};
    const auto hit = world.meet_ground(ray, 100.0, random());
    REQUIRE(hit.has_value());
    const double height_m = 2.0 + hit->range_m * ray.direction.z();
    CHECK(height_m >= 0.0);
    sum += height_m;
  }

  CHECK(sum / n == Approx(0.05).epsilon(0.05));
}

TEST_CASE("Foliage lets rays through as often as its density implies", "[shapes]") {
  Random random(6);
  const double density = 0.4;
  World world;
  world.add(ObjectClass::kBush, Foliage{{10.0, 0.0, 1.0}, 2.0, 2.0, density});
  RayCaster caster(world);
  const Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  int through = 0;

  double sum_of_depths = 0.0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    RayHit hit;
    caster.cast({0.0, 0.0, 1.0}, {&direction, 1}, 0.0, 100.0, random(), {&hit, 1});
    if (!hit.is_hit) {
      ++through;
    } else {
      sum_of_depths += hit.range_m - 8.0;
    }
  }

  const double expected = std::exp(-4.0 * density);
  CHECK(through / double(n) == Approx(expected).margin(0.01));

  // Mean depth of those that were stopped within 4 m.
  const double mean = 1.0 / density - 4.0 * expected / (1.0 - expected);
  CHECK(sum_of_depths / (n - through) == Approx(mean).margin(0.03));
}
