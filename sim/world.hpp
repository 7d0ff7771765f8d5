// A simulated 3-D world: ground, and objects on it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim/ground.hpp"
#include "sim/shapes.hpp"

namespace understory::sim {

/// Class of an object, for reflectivity and for the truth of a classifier.
enum class ObjectClass : std::uint8_t {
  kGround,
  kTrunk,
  kPole,    ///< Lamp post, traffic sign, fence post: round and upright like a trunk.
  kBranch,  ///< Dead branch on a trunk.
  kCrown,
  kBush,
  kWall,  ///< Of a house; two of them meet in a corner.
  kCar,
  kPerson,
  kFurniture,  ///< Desks, racks, boxes, tanks; also logs in a forest.
};

/// Index of an object in its world; the ground has none of its own.
using ObjectId = std::uint32_t;
inline constexpr ObjectId kGroundObject = 0xffffffffU;

/// A position on a trunk (or pole) that a mapper should find.
struct TrueTrunk {
  ObjectId object = 0;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< Of the stem, 1.3 m above the ground.
  double radius_m = 0.0;                               ///< At that height.
};
/// An upright edge of a house, where two walls meet.
struct TrueCorner {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double ground_m = 0.0;
  /// Direction of the bisector, out of the house, in `world`.
  double bisector_rad = 0.0;
  /// Angle between the walls, outside the house: 3/2 pi at the outer corner of a square house.
  double angle_rad = 0.0;
  ObjectId wall_before = 0;  ///< Ends at the corner.
  ObjectId wall_after = 0;   ///< Begins there.
};

/// A person who walks between two points.
struct Walker {
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< Of the walker's path, on the ground.
  Eigen::Vector2d reach_m =
      Eigen::Vector2d::Zero();  ///< From the middle to the end; 0 = stationary.
  double speed_mps = 1.2;       ///< Mean; slows down towards the ends.
  double phase_rad = 0.0;
  double radius_m = 0.22;
  double height_m = 1.75;

  /// The walker's shape at a time [s].
  Stem at(double time_s) const;
};

/// All in frame `world` (x east, y north, z up). Objects are added once and never changed.
class World {
 public:
  /// Without objects.
  explicit World(Ground ground = {}) : ground_(std::move(ground)) {}

  /// Adds a stem; returns its index.
  ObjectId add(ObjectClass kind, const Stem& stem);
  /// Adds foliage; returns its index.
  ObjectId add(ObjectClass kind, const Foliage& foliage);
  /// Adds a wall; returns its index.
  ObjectId add(ObjectClass kind, const Wall& wall);
  /// Adds a box; returns its index.
  ObjectId add(ObjectClass kind, const Box& box);
  /// Adds a walker; returns its index.
  ObjectId add(const Walker& walker);
  /// A trunk or pole whose centre 1.3 m above the ground at `breast_m` has radius `radius_m`;
  /// rooted below the ground. `lean` is the horizontal part of its axis.
  ObjectId add_trunk(ObjectClass kind, const Eigen::Vector2d& breast_m, double radius_m,
                     double height_m, double taper = 0.0,
                     const Eigen::Vector2d& lean = Eigen::Vector2d::Zero());
  /// Walls around `footprint_m` (counter-clockwise), from below the ground to `height_m` above
  /// the highest ground at a corner.
  void add_house(std::span<const Eigen::Vector2d> footprint_m, double height_m);

  /// The ground below the objects.
  const Ground& ground() const { return ground_; }
  /// Number of objects.
  std::size_t object_count() const { return objects_.size(); }
  /// Class of an object, or of the ground.
  ObjectClass kind(ObjectId object) const;
  /// Bounds of an object; of a walker, of its whole path.
  const Bounds& bounds(ObjectId object) const { return objects_[object].bounds; }
  /// Whether the object is a walker.
  bool moves(ObjectId object) const { return objects_[object].shape == Shape::kWalker; }
  /// Key of the object's random properties: which leaf stops a ray, its reflectivity. Its id,
  /// unless set_key() set another one.
  std::uint64_t key(ObjectId object) const {
    return object == kGroundObject ? kGroundObject : objects_[object].key;
  }
  /// Sets a key that does not depend on the object's id, so that it looks the same in another
  /// world.
  void set_key(ObjectId object, std::uint64_t key) { objects_[object].key = key; }
  /// The shape of a trunk, pole, branch or tank; null for other shapes.
  const Stem* stem(ObjectId object) const;

  /// The trunks and poles added by add_trunk(), in order.
  std::span<const TrueTrunk> trunks() const { return trunks_; }
  /// The corners of all houses.
  std::span<const TrueCorner> corners() const { return corners_; }

  /// Intersection of the ray with the object at `time_s`. `luck` determines the ray's range in
  /// foliage.
  std::optional<SurfaceHit> meet_object(const Ray& ray, ObjectId object, double time_s,
                                        std::uint64_t luck) const;
  /// Intersection of the ray with the ground, or its cover, within `max_m`.
  std::optional<SurfaceHit> meet_ground(const Ray& ray, double max_m, std::uint64_t luck) const;

 private:
  enum class Shape : std::uint8_t { kStem, kFoliage, kWall, kBox, kWalker };
  struct Object {
    Bounds bounds;
    ObjectClass kind = ObjectClass::kTrunk;
    Shape shape = Shape::kStem;
    std::uint32_t index = 0;  ///< Among the objects of its shape.
    std::uint64_t key = 0;
  };
  ObjectId add_object(ObjectClass kind, Shape shape, std::size_t index, const Bounds& bounds);

  Ground ground_;
  std::vector<Object> objects_;
  std::vector<Stem> stems_;
  std::vector<Foliage> foliages_;
  std::vector<Wall> walls_;
  std::vector<Box> boxes_;
  std::vector<Walker> walkers_;
  std::vector<TrueTrunk> trunks_;
  std::vector<TrueCorner> corners_;
};

}  // namespace understory::sim
