// Points on the surfaces of things that a keypoint detector would detect repeatedly.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sim/changes/scene.hpp"

namespace understory::sim::changes {

/// Id of a point: the id of its thing and a number on it. It moves with the thing.
using PointId = std::uint64_t;
/// No point: a false keypoint.
inline constexpr PointId kNoPoint = 0;
/// Bits of the number on the thing; the thing's id is above them.
inline constexpr int kPointBits = 20;
/// The thing of a point.
constexpr ThingId thing_of(PointId point) { return static_cast<ThingId>(point >> kPointBits); }

/// A binary descriptor of 256 bits, as in BRIEF and ORB.
using Descriptor = std::array<std::uint64_t, 4>;
/// Number of bits in which two descriptors differ.
int hamming_distance(const Descriptor& a, const Descriptor& b);

/// A point with its texture.
struct SurfacePoint {
  PointId id = kNoPoint;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Frame `world`.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();     ///< Unit, out of the thing.
  Descriptor descriptor{};                               ///< Without noise.
};

/// Density of points, and their similarity.
struct TextureParameters {
  double structure_per_m2 = 4.0;  ///< On walls and ceilings.
  double thing_per_m2 = 20.0;     ///< On furniture and equipment.
  double paint_per_m2 = 4.0;      ///< On cars, lorries and carts.
  double trunk_per_m2 = 15.0;     ///< On trunks, up to `trunk_height_m`.
  double trunk_height_m = 3.5;    ///< Above the ground.
  double repeated_share = 0.2;    ///< Of the points with a repeated texture: labels, screws, bark.
  int repeated_textures = 64;     ///< Number of different repeated textures in a scene.
};

/// All points of the scene, in order of id. A thing has the same points in every copy. None on the
/// ground, on leaves, on branches and on the lids of tanks.
std::vector<SurfacePoint> surface_points(const Scene& scene, const BuiltScene& built,
                                         const TextureParameters& parameters = {});

/// A point of a scanner's map of the scene.
struct MappedPoint {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< Frame `world`.
  ThingId thing = kGroundThing;
};
/// `per_m2` points on the same surfaces, in order of thing, after a tenth as many on the ground.
std::vector<MappedPoint> sampled_surface(const Scene& scene, const BuiltScene& built,
                                         double per_m2);

}  // namespace understory::sim::changes
