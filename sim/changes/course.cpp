#include "sim/changes/course.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>

#include "sim/changes/placing.hpp"
#include "sim/forest_world.hpp"
#include "sim/path.hpp"
#include "sim/random_streams.hpp"

namespace understory::sim::changes {
namespace {

using std::numbers::pi;
using Pose6 = UniformSpline<6>::Vector;

constexpr double kPlaceSpacing = 0.25;  ///< Of the path, in the search for free space [m].

/// Number of things of each kind in a scene.
struct Furnishing {
  ThingKind kind;
  int count;
};

void furnish(Scene& scene, FreeSpace& space, std::span<const Furnishing> furnishings,
             std::mt19937_64& random) {
  for (const Furnishing& furnishing : furnishings) {
    for (int i = 0; i < furnishing.count; ++i) {
      // A full room gets no more things.
      if (auto thing = place(scene, furnishing.kind, space, random)) scene.add(std::move(*thing));
    }
  }
}

Thing structure_of(const Part& part, const Box& extent) {
  Thing thing;
  thing.kind = ThingKind::kStructure;
  thing.parts = {part};
  thing.extent = extent;
  return thing;
}

Thing wall_of(const Wall& wall) {
  const Eigen::Vector2d side = wall.to_m - wall.from_m;
  const Eigen::Vector2d middle = wall.from_m + 0.5 * side;
  Box extent;
  extent.centre_m << middle, 0.5 * (wall.low_m + wall.high_m);
  extent.half_size_m << 0.5 * side.norm(), 0.0, 0.5 * (wall.high_m - wall.low_m);
  extent.heading_rad = std::atan2(side.y(), side.x());
  return structure_of(wall, extent);
}

/// Four walls, each with its outside towards the room, and a ceiling. The floor is the ground.
void add_room(Scene& scene) {
  const Eigen::Vector3d& low = scene.low_m;
  const Eigen::Vector3d& high = scene.high_m;
  const std::vector<Eigen::Vector2d> corners{
      low.head<2>(), {low.x(), high.y()}, high.head<2>(), {high.x(), low.y()}};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    scene.add(wall_of({corners[i], corners[(i + 1) % 4], low.z(), high.z()}));
  }

  Box ceiling;
  ceiling.centre_m = 0.5 * (low + high);
  ceiling.half_size_m = 0.5 * (high - low) + Eigen::Vector3d(0.1, 0.1, 0.0);
  ceiling.half_size_m.z() = 0.05;
  ceiling.centre_m.z() = high.z() + 0.05;
  scene.add(structure_of(ceiling, ceiling));
}

/// Smooth ramp from 0 to 1, with zero speed and acceleration at the ends.
double eased(double share) {
  const double x = std::clamp(share, 0.0, 1.0);
  return x * x * x * (10.0 + x * (6.0 * x - 15.0));
}

/// Rotations of the gaze along the path, which a flying body can make.
Pose6 gazing(const Eigen::Vector3d& at_m, double heading_rad, double along_m) {
  Pose6 pose;
  const double yaw = heading_rad + 0.8 * std::sin(2.0 * pi * along_m / 5.3);
  const double pitch = 0.2 * std::sin(2.0 * pi * along_m / 3.7);
  pose << at_m, 0.0, pitch, yaw;
  return pose;
}

/// A path by distance, at `speed_mps` with smooth ends.
template <typename PoseAt>
RecordedPath flown(double length_m, const CourseParameters& parameters, PoseAt pose_at) {
  RecordedPath path;
  const double speed_mps = parameters.speed_mps > 0.0 ? parameters.speed_mps : 0.5;
  const double ramp_s = 2.0;
  const double flight_s = length_m / speed_mps + ramp_s;
  const auto count = static_cast<int>((flight_s + 2.0 * parameters.standstill_s) / path.step_s);

  // The speed is constant except for a ramp at each end; the distance is its running sum.
  double along_m = 0.0;
  for (int k = 0; k < count; ++k) {
    const double t = k * path.step_s - parameters.standstill_s;
    const double share = std::min(eased(t / ramp_s), eased((flight_s - t) / ramp_s));
    path.poses.push_back(pose_at(along_m));
    along_m = std::min(length_m, along_m + share * speed_mps * path.step_s);
  }
  return path;
}

/// Around the room, 2.2 m from its walls, at the height of a head.
RecordedPath round_the_room(const Scene& scene, const CourseParameters& parameters) {
  const double inside_m = 2.2;
  const Eigen::Vector2d middle = 0.5 * (scene.low_m + scene.high_m).head<2>();
  const Eigen::Vector2d half =
      0.5 * (scene.high_m - scene.low_m).head<2>() - Eigen::Vector2d::Constant(inside_m);

  // An ellipse by its eccentric angle: smooth everywhere.
  const double lap_m = 2.0 * pi * std::sqrt(0.5 * half.squaredNorm());
  return flown(parameters.laps * lap_m, parameters, [=](double along_m) {
    const double angle = 2.0 * pi * along_m / lap_m;
    const Eigen::Vector2d at =
        middle + half.cwiseProduct(Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    const Eigen::Vector2d ahead(-half.x() * std::sin(angle), half.y() * std::cos(angle));
    double heading = std::atan2(ahead.y(), ahead.x());
    // Unwrapped: it begins at pi/2 and rises by 2 pi a lap.
    const double wanted = 0.5 * pi + angle;
    heading += 2.0 * pi * std::round((wanted - heading) / (2.0 * pi));
    const double z = 1.35 + 0.2 * std::sin(2.0 * pi * along_m / 6.1);
    return gazing({at.x(), at.y(), z}, heading, along_m);
  });
}

/// Along the module's axis and back on the other side of it, with a turn at each end: a long oval.
RecordedPath along_the_module(const Scene& scene, const CourseParameters& parameters) {
  const double aside_m = 0.3;
  const Eigen::Vector3d middle = 0.5 * (scene.low_m + scene.high_m);
  const double reach_m = 0.5 * (scene.high_m.x() - scene.low_m.x()) - 1.2;
  const double lap_m = 4.0 * reach_m;
  return flown(parameters.laps * lap_m, parameters, [=](double along_m) {
    const double angle = 2.0 * pi * along_m / lap_m;
    const double x = middle.x() - reach_m * std::cos(angle);
    const double y = middle.y() - aside_m * std::sin(angle);
    const double z = middle.z() + 0.2 * std::sin(2.0 * angle);
    // It looks ahead except at the ends, where it turns round.
    const double lap = std::floor(angle / (2.0 * pi));
    const double share = angle / (2.0 * pi) - lap;
    const double turned =
        eased((share - 0.40) / 0.2) + eased((share - 0.9) / 0.2) + eased((share + 0.1) / 0.2) - 1.0;
    return gazing({x, y, z}, pi * (2.0 * lap + turned), along_m);
  });
}

Scene room_scene(SceneKind kind, const Eigen::Vector3d& size_m, std::uint64_t seed) {
  Scene scene;
  scene.kind = kind;
  scene.seed = seed;
  scene.ground = std::make_shared<const Ground>();
  scene.high_m = size_m;
  add_room(scene);
  return scene;
}

Route route_of(const RecordedPath& path) {
  std::vector<Eigen::Vector2d> points;
  for (const Eigen::Vector3d& place : path.places_m(0.1)) points.emplace_back(place.head<2>());
  return Route::through(points, 0.2);
}

Course furnished_room(SceneKind kind, const CourseParameters& parameters, std::uint64_t seed) {
  const bool is_office = kind == SceneKind::kOffice;
  Scene scene = room_scene(
      kind, is_office ? Eigen::Vector3d(12.0, 9.0, 2.8) : Eigen::Vector3d(12.0, 3.4, 2.3), seed);
  RecordedPath path =
      is_office ? round_the_room(scene, parameters) : along_the_module(scene, parameters);
  const std::vector<Eigen::Vector3d> places = path.places_m(kPlaceSpacing);

  FreeSpace space = free_space(scene, places);
  std::mt19937_64 random = random_stream(seed, Stream::kScenery);
  const std::vector<Furnishing> furnishings =
      is_office ? std::vector<Furnishing>{{ThingKind::kFurniture, 24}, {ThingKind::kEquipment, 26}}
                : std::vector<Furnishing>{{ThingKind::kFurniture, 6}, {ThingKind::kEquipment, 44}};
  furnish(scene, space, furnishings, random);

  Route route = route_of(path);
  return {std::move(scene), std::move(path), std::move(route)};
}

/// A circle in the middle of a forest of the right size.
Route circle(const CourseParameters& parameters, double side_m) {
  PathParameters shape;
  shape.kind = PathKind::kCircle;
  shape.length_m = parameters.length_m;
  shape.interval = 0.5;
  std::vector<Eigen::Vector2d> points;
  for (int lap = 0; lap < parameters.laps; ++lap) {
    for (const geometry::SE2& pose : make_path(shape)) points.push_back(pose.translation());
  }
  points.push_back(points.front());
  const double radius_m = parameters.length_m / (2.0 * pi);
  return Route::through(points, 1.0).moved({0.5 * side_m, 0.5 * side_m - radius_m, 0.0});
}

RecordedPath driven(const Route& route, const Ground& ground, const CourseParameters& parameters) {
  SpeedParameters speed;
  speed.cruise_mps = parameters.speed_mps > 0.0 ? parameters.speed_mps : 2.0;
  speed.standstill_s = parameters.standstill_s;
  const VehicleMotion motion(route, ground, VehicleParameters{}, speed);

  RecordedPath path;
  const auto count = static_cast<int>(std::floor(motion.duration_s() / path.step_s)) + 1;
  for (int k = 0; k < count; ++k) {
    const VehicleState state = motion.at(k * path.step_s);
    Pose6 pose;
    pose << state.position_m, state.roll_rad, state.pitch_rad, state.yaw_rad;
    path.poses.push_back(pose);
  }
  return path;
}

/// Trunks at the forest's positions, except on the path; then things between them.
void plant(Scene& scene, const ForestParameters& kind, FreeSpace& space, std::mt19937_64& random) {
  const ForestWorldParameters plants;
  for (const Eigen::Vector2d& at : make_forest(kind, random).trunks_m) {
    const double radius_m = draw_radius_m(plants, random);
    const double crown_base_m = plants.crown_base_m * uniform(random, 0.7, 1.3);
    Thing tree;
    tree.kind = ThingKind::kTree;
    tree.parts = {Tree{at, radius_m, crown_base_m}};
    tree.extent = {
        {at.x(), at.y(), scene.ground->height(at) + 3.0}, {radius_m, radius_m, 3.0}, 0.0};
    if (!space.has_room(tree.extent)) continue;
    space.take(tree.extent);
    scene.add(std::move(tree));
  }
}

Course forest_course(const CourseParameters& parameters, std::uint64_t seed) {
  ForestParameters forest = forest_parameters(parameters.forest);
  forest.side_m = parameters.length_m / pi + 2.0 * parameters.margin_m;
  std::mt19937_64 random = random_stream(seed, Stream::kForest);
  std::mt19937_64 scenery = random_stream(seed, Stream::kScenery);

  Scene scene;
  scene.kind = SceneKind::kForest;
  scene.seed = seed;
  scene.ground = std::make_shared<const Ground>(ForestWorldParameters{}.ground, scenery);
  scene.high_m = {forest.side_m, forest.side_m, 20.0};

  Route route = circle(parameters, forest.side_m);
  RecordedPath path = driven(route, *scene.ground, parameters);
  FreeSpace space = free_space(scene, path.places_m(kPlaceSpacing));
  furnish(scene, space, std::vector<Furnishing>{{ThingKind::kVehicle, 4}}, scenery);
  plant(scene, forest, space, random);
  const auto bushes = static_cast<int>(80e-4 * forest.side_m * forest.side_m);
  furnish(scene, space,
          std::vector<Furnishing>{{ThingKind::kEquipment, 12}, {ThingKind::kBush, bushes}},
          scenery);

  return {std::move(scene), std::move(path), std::move(route)};
}

}  // namespace

std::vector<Eigen::Vector3d> RecordedPath::places_m(double spacing_m) const {
  std::vector<Eigen::Vector3d> places;
  for (const Pose6& pose : poses) {
    const Eigen::Vector3d place = pose.head<3>();
    if (places.empty() || (place - places.back()).norm() >= spacing_m) places.push_back(place);
  }
  return places;
}

Course make_course(SceneKind kind, const CourseParameters& parameters, std::uint64_t seed) {
  if (parameters.laps < 1 || !(parameters.length_m > 0.0))
    throw std::runtime_error("a course has a lap at least, and a length");
  return kind == SceneKind::kForest ? forest_course(parameters, seed)
                                    : furnished_room(kind, parameters, seed);
}

}  // namespace understory::sim::changes
