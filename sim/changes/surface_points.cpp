#include "sim/changes/surface_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <span>

#include "sim/hash_random.hpp"
#include "sim/random_streams.hpp"

namespace understory::sim::changes {
namespace {

using std::numbers::pi;

constexpr std::uint64_t kSurfacePurpose = 0x9017;
constexpr std::uint64_t kTexturePurpose = 0x7e47;
constexpr double kGroundGap = 0.02;  ///< Lower sides closer to the ground have no points [m].

/// Draws points on one thing.
class PointSampler {
 public:
  PointSampler(const Scene& scene, const BuiltScene& built, const TextureParameters& textures)
      : scene_(scene), built_(built), textures_(textures) {}

  /// `first_object`: index of the thing's first shape in the world.
  void sample(const Thing& thing, ObjectId first_object, std::vector<SurfacePoint>& points) {
    thing_ = &thing;
    object_ = first_object;
    points_ = &points;
    count_ = 0;
    random_ = random_of_thing(scene_, thing.id, kSurfacePurpose);
    for (const Part& part : thing.parts) std::visit(*this, part);
  }

  void operator()(const Tree& /*tree*/) {
    // The trunk is the first shape added by plant_tree().
    const Stem* trunk = built_.world->stem(object_);
    if (trunk == nullptr) return;
    const double root_m = 0.5;  // of a trunk, below the ground
    on_stem(*trunk, root_m + 0.2, root_m + textures_.trunk_height_m, textures_.trunk_per_m2);
  }
  void operator()(const Bush& /*bush*/) {}
  void operator()(const Stem& stem) { on_stem(stem, 0.0, stem.length_m, density()); }

  void operator()(const Wall& wall) {
    const Eigen::Vector2d side = wall.to_m - wall.from_m;
    const double height = wall.high_m - wall.low_m;
    const Eigen::Vector3d normal = Eigen::Vector3d(side.y(), -side.x(), 0.0).normalized();
    const int count = draw_count(side.norm() * height * density());
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d at = wall.from_m + uniform(random_, 0.0, 1.0) * side;
      add({at.x(), at.y(), wall.low_m + uniform(random_, 0.0, height)}, normal);
    }
  }

  void operator()(const Box& box) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) on_face(box, axis, sign);
    }
  }

 private:
  double density() const {
    switch (thing_->kind) {
      case ThingKind::kStructure:
        return textures_.structure_per_m2;
      case ThingKind::kVehicle:
      case ThingKind::kLorry:
        return textures_.paint_per_m2;
      default:
        return textures_.thing_per_m2;
    }
  }
  int draw_count(double mean) {
    return mean > 0.0 ? std::poisson_distribution<int>(mean)(random_) : 0;
  }

  void on_face(const Box& box, int axis, double sign) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    const Eigen::Vector3d& half = box.half_size_m;
    const int count = draw_count(4.0 * half[u] * half[v] * density());
    const Eigen::AngleAxisd turn(box.heading_rad, Eigen::Vector3d::UnitZ());
    const double low = box.centre_m.z() - half.z();
    const bool is_on_ground =
        axis == 2 && sign < 0.0 && low - scene_.ground->height(box.centre_m.head<2>()) < kGroundGap;

    for (int i = 0; i < count; ++i) {
      Eigen::Vector3d local = Eigen::Vector3d::Zero();
      local[axis] = sign * half[axis];
      local[u] = uniform(random_, -half[u], half[u]);
      local[v] = uniform(random_, -half[v], half[v]);
      if (is_on_ground) continue;
      add(box.centre_m + turn * local, turn * (sign * Eigen::Vector3d::Unit(axis)));
    }
  }

  void on_stem(const Stem& stem, double from_m, double to_m, double per_m2) {
    const double mean_radius = stem.radius_at(0.5 * (from_m + to_m));
    const int count = draw_count(2.0 * pi * mean_radius * (to_m - from_m) * per_m2);
    const Eigen::Vector3d across = stem.axis.unitOrthogonal();
    const Eigen::Vector3d other = stem.axis.cross(across);
    for (int i = 0; i < count; ++i) {
      const double along = uniform(random_, from_m, to_m);
      const double angle = uniform(random_, -pi, pi);
      const Eigen::Vector3d out = std::cos(angle) * across + std::sin(angle) * other;
      const Eigen::Vector3d normal = (out + stem.taper * stem.axis).normalized();
      add(stem.centre_at(along) + stem.radius_at(along) * out, normal);
    }
  }

  void add(const Eigen::Vector3d& position_m, const Eigen::Vector3d& normal) {
    SurfacePoint point;
    point.id = (PointId{thing_->id} << kPointBits) | ++count_;
    point.position_m = position_m;
    point.normal = normal;
    point.descriptor = descriptor(point.id);
    points_->push_back(point);
  }

  Descriptor descriptor(PointId id) const {
    std::uint64_t key = mixed(mixed(scene_.seed, kTexturePurpose), id);
    if (uniform_of(mixed(key, 1)) < textures_.repeated_share) {
      const std::uint64_t which =
          mixed(key, 2) % static_cast<std::uint64_t>(std::max(1, textures_.repeated_textures));
      key = mixed(mixed(scene_.seed, kTexturePurpose + 1), which);
    }
    return {mixed(key, 3), mixed(key, 4), mixed(key, 5), mixed(key, 6)};
  }

  const Scene& scene_;
  const BuiltScene& built_;
  const TextureParameters& textures_;
  const Thing* thing_ = nullptr;
  ObjectId object_ = 0;
  std::vector<SurfacePoint>* points_ = nullptr;
  std::uint64_t count_ = 0;
  std::mt19937_64 random_;
};

}  // namespace

int hamming_distance(const Descriptor& a, const Descriptor& b) {
  int distance = 0;
  for (std::size_t i = 0; i < a.size(); ++i) distance += std::popcount(a[i] ^ b[i]);
  return distance;
}

std::vector<SurfacePoint> surface_points(const Scene& scene, const BuiltScene& built,
                                         const TextureParameters& parameters) {
  std::vector<SurfacePoint> points;
  PointSampler sampler(scene, built, parameters);
  ObjectId object = 0;
  for (const Thing& thing : scene.things) {
    sampler.sample(thing, object, points);
    while (object < built.thing_of_object.size() && built.thing_of_object[object] == thing.id)
      ++object;
  }
  return points;
}

std::vector<MappedPoint> sampled_surface(const Scene& scene, const BuiltScene& built,
                                         double per_m2) {
  std::vector<MappedPoint> cloud;
  const Eigen::Vector2d low = scene.low_m.head<2>();
  const Eigen::Vector2d size = scene.high_m.head<2>() - low;
  std::mt19937_64 random = random_of_thing(scene, kGroundThing, kSurfacePurpose);
  const auto on_ground = static_cast<int>(0.1 * per_m2 * size.prod());
  for (int i = 0; i < on_ground; ++i) {
    Eigen::Vector2d at(uniform(random, 0.0, size.x()), 0.0);
    at.y() = uniform(random, 0.0, size.y());
    at += low;
    cloud.push_back({Eigen::Vector3d(at.x(), at.y(), scene.ground->height(at)).cast<float>()});
  }

  TextureParameters even;
  even.structure_per_m2 = even.thing_per_m2 = even.paint_per_m2 = even.trunk_per_m2 = per_m2;
  for (const SurfacePoint& point : surface_points(scene, built, even))
    cloud.push_back({point.position_m.cast<float>(), thing_of(point.id)});
  return cloud;
}

}  // namespace understory::sim::changes
