#include "sim/street_world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/point_grid.hpp"

namespace understory::sim {
namespace {

using std::numbers::pi;

/// Places objects beside the route, in free space.
class Builder {
 public:
  Builder(const Route& route, const StreetWorldParameters& parameters, std::mt19937_64& random)
      : route_(route),
        parameters_(parameters),
        random_(random),
        world_(Ground(parameters.ground, random)),
        way_(route.places(0.5), 20.0) {}

  void build(double from_m, double to_m, const Roadside& roadside) {
    const double wood_side = uniform(0.0, 1.0) < 0.5 ? 1.0 : -1.0;
    // Houses first: all other objects are placed around them.
    repeat(from_m, to_m, roadside.houses, [&](double s) { add_house(s); });
    repeat(from_m, to_m, roadside.cars, [&](double s) { add_car(s); });
    repeat(from_m, to_m, roadside.poles, [&](double s) { add_pole(s); });
    repeat(from_m, to_m, roadside.trees, [&](double s) { add_tree(s, side(), 4.5, 25.0); });
    repeat(from_m, to_m, roadside.wood_trees, [&](double s) { add_tree(s, wood_side, 9.0, 60.0); });
    repeat(from_m, to_m, roadside.bushes, [&](double s) { add_bush(s); });
    repeat(from_m, to_m, roadside.people, [&](double s) { add_person(s); });
  }

  void add_mapped_pole(const Eigen::Vector2d& at_m, double radius_m) {
    if (way_.any_within(at_m, parameters_.clearance_m)) return;
    const bool is_tree = radius_m > 0.0 ? radius_m > 0.12 : uniform(0.0, 1.0) < 0.5;
    if (is_tree) {
      const double radius = radius_m > 0.0 ? radius_m : draw_radius_m(parameters_.plants, random_);
      plant_tree(world_, at_m, radius, uniform(2.5, 4.5), parameters_.plants, random_);
    } else {
      const double radius = radius_m > 0.0 ? radius_m : uniform(0.05, 0.12);
      world_.add_trunk(ObjectClass::kPole, at_m, radius, uniform(3.5, 8.0));
    }
  }

  World take() { return std::move(world_); }

 private:
  struct Disc {
    Eigen::Vector2d centre_m;
    double radius_m;
  };

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double side() { return uniform(0.0, 1.0) < 0.5 ? 1.0 : -1.0; }

  template <typename Add>
  void repeat(double from_m, double to_m, double per_100_m, Add add) {
    const double mean = 0.01 * (to_m - from_m) * per_100_m;
    if (mean <= 0.0) return;
    const int count = std::poisson_distribution<int>(mean)(random_);
    for (int i = 0; i < count; ++i) add(uniform(from_m, to_m));
  }

  /// Position `aside_m` to the left of the route at `along_m`.
  Eigen::Vector2d beside(double along_m, double aside_m) const {
    const Route::Place place = route_.at(along_m);
    return place.position_m +
           aside_m * Eigen::Vector2d(-std::sin(place.heading_rad), std::cos(place.heading_rad));
  }
  bool is_free(const Eigen::Vector2d& at_m, double radius_m, double path_clearance_m) const {
    if (way_.any_within(at_m, path_clearance_m + radius_m)) return false;
    return std::none_of(houses_.begin(), houses_.end(), [&](const Disc& house) {
      const double least = house.radius_m + radius_m;
      return (house.centre_m - at_m).squaredNorm() < least * least;
    });
  }

  /// A rectangle, or an L: each corner in (forward, left) of the street.
  std::vector<Eigen::Vector2d> footprint(double width, double depth) {
    const double w = 0.5 * width;
    const double d = 0.5 * depth;
    if (uniform(0.0, 1.0) < 0.7) return {{-w, -d}, {w, -d}, {w, d}, {-w, d}};
    const double notch_w = uniform(0.3, 0.5) * width;
    const double notch_d = uniform(0.3, 0.5) * depth;
    return {{-w, -d},         {w, -d}, {w, d - notch_d}, {w - notch_w, d - notch_d},
            {w - notch_w, d}, {-w, d}};
  }

  void add_house(double along_m) {
    const double width = uniform(8.0, 15.0);
    const double depth = uniform(7.0, 11.0);
    const double heading = route_.at(along_m).heading_rad + uniform(-0.03, 0.03);
    const double radius = 0.5 * std::hypot(width, depth);
    const double distance = parameters_.house_distance_m + 0.5 * depth + uniform(0.0, 5.0);
    const Eigen::Vector2d middle = beside(along_m, side() * distance);
    if (!is_free(middle, radius, parameters_.house_distance_m - 4.0)) return;
    houses_.push_back({middle, radius});
    const geometry::SE2 world_T_house(middle, heading + (uniform(0.0, 1.0) < 0.5 ? 0.0 : pi));
    std::vector<Eigen::Vector2d> corners = footprint(width, depth);
    for (Eigen::Vector2d& corner : corners) corner = world_T_house * corner;
    world_.add_house(corners, uniform(4.5, 8.0));
  }

  /// Body and cabin.
  void add_car(double along_m) {
    const double aside = side() * uniform(3.6, 4.2);
    const Eigen::Vector2d at = beside(along_m, aside);
    if (!is_free(at, 2.4, parameters_.clearance_m - 1.6)) return;
    const double heading = route_.at(along_m).heading_rad + uniform(-0.05, 0.05);
    const double ground = world_.ground().height(at);
    const Eigen::Vector3d body(uniform(1.9, 2.3), uniform(0.83, 0.93), 0.3);
    world_.add(ObjectClass::kCar, Box{{at.x(), at.y(), ground + 0.55}, body, heading});
    const Eigen::Vector2d cabin_at =
        at - 0.15 * body.x() * Eigen::Vector2d(std::cos(heading), std::sin(heading));
    const Eigen::Vector3d cabin(0.55 * body.x(), 0.85 * body.y(), 0.3);
    world_.add(ObjectClass::kCar, Box{{cabin_at.x(), cabin_at.y(), ground + 1.15}, cabin, heading});
  }

  void add_pole(double along_m) {
    const Eigen::Vector2d at = beside(along_m, side() * uniform(4.3, 6.0));
    if (!is_free(at, 0.2, parameters_.clearance_m)) return;
    const bool is_lamp = uniform(0.0, 1.0) < 0.6;
    world_.add_trunk(ObjectClass::kPole, at, is_lamp ? uniform(0.06, 0.11) : uniform(0.03, 0.05),
                     is_lamp ? uniform(5.0, 8.0) : uniform(2.2, 3.2));
  }

  void add_tree(double along_m, double to_side, double nearest_m, double farthest_m) {
    const Eigen::Vector2d at = beside(along_m, to_side * uniform(nearest_m, farthest_m));
    if (!is_free(at, 0.8, parameters_.clearance_m)) return;
    const double radius = draw_radius_m(parameters_.plants, random_);
    plant_tree(world_, at, radius, uniform(2.2, 4.0), parameters_.plants, random_);
  }

  void add_bush(double along_m) {
    const Eigen::Vector2d at = beside(along_m, side() * uniform(4.5, 22.0));
    if (!is_free(at, 0.6, parameters_.clearance_m + 0.7)) return;
    plant_bush(world_, at, parameters_.plants.bush_density_per_m, random_);
  }

  void add_person(double along_m) {
    const double aside = side() * uniform(4.4, 6.5);
    Walker walker;
    walker.middle_m.head<2>() = beside(along_m, aside);
    if (!is_free(walker.middle_m.head<2>(), 0.4, parameters_.clearance_m)) return;
    walker.middle_m.z() = world_.ground().height(walker.middle_m.head<2>());
    const double heading = route_.at(along_m).heading_rad;
    if (uniform(0.0, 1.0) < 0.7) {
      walker.reach_m = uniform(2.0, 10.0) * Eigen::Vector2d(std::cos(heading), std::sin(heading));
    }
    walker.phase_rad = uniform(-pi, pi);
    world_.add(walker);
  }

  const Route& route_;
  const StreetWorldParameters& parameters_;
  std::mt19937_64& random_;
  World world_;
  PointGrid way_;
  std::vector<Disc> houses_;
};

}  // namespace

Roadside town_roadside() {
  return {.houses = 14.0, .cars = 6.0, .poles = 7.0, .trees = 12.0, .bushes = 18.0, .people = 2.5};
}
Roadside avenue_roadside() { return {.poles = 4.0, .trees = 14.0, .bushes = 8.0}; }
Roadside field_roadside() { return {.poles = 0.8, .trees = 0.6, .bushes = 2.5}; }
Roadside wood_roadside() {
  return {.poles = 1.5, .trees = 2.0, .bushes = 12.0, .wood_trees = 90.0};
}
Roadside village_roadside() {
  return {.houses = 4.0, .cars = 1.5, .poles = 4.0, .trees = 10.0, .bushes = 12.0, .people = 0.7};
}

World make_street_world(const Route& route, std::span<const Stretch> stretches,
                        const StreetWorldParameters& parameters, std::mt19937_64& random) {
  Builder builder(route, parameters, random);
  double from_m = 0.0;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const bool is_last = i + 1 == stretches.size();
    const double to_m =
        is_last ? route.length_m() : std::min(route.length_m(), from_m + stretches[i].length_m);
    if (to_m > from_m) builder.build(from_m, to_m, stretches[i].roadside);
    from_m = to_m;
  }
  return builder.take();
}

World make_pole_world(const Route& route, const Forest& poles,
                      const StreetWorldParameters& parameters, std::mt19937_64& random) {
  Builder builder(route, parameters, random);
  for (std::size_t i = 0; i < poles.trunks_m.size(); ++i) {
    builder.add_mapped_pole(poles.trunks_m[i], poles.radii_m[i]);
  }
  builder.build(0.0, route.length_m(), {.cars = 3.0, .bushes = 8.0, .people = 0.5});
  return builder.take();
}

}  // namespace understory::sim
