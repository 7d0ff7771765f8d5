// The shapes of simulated worlds, and their intersections with rays.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace understory::sim {

/// A half-line.
struct Ray {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< Unit.
};

/// First intersection of a ray with a surface from outside.
struct SurfaceHit {
  double range_m = 0.0;
  double cosine = 1.0;  ///< Of the angle between the ray and the surface's normal, in [0, 1].
};

/// A straight stem: a cone on `base_m`, without end faces.
struct Stem {
  Eigen::Vector3d base_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< Unit, upwards.
  double base_radius_m = 0.1;
  double taper = 0.0;  ///< Loss of radius per metre along the axis.
  double length_m = 10.0;

  /// Radius at a distance from the base along the axis.
  double radius_at(double along_m) const { return base_radius_m - taper * along_m; }
  /// Point of the axis at a distance from the base.
  Eigen::Vector3d centre_at(double along_m) const { return base_m + along_m * axis; }
};

/// An ellipsoid with axes along x and y (equal) and z, filled with leaves: the range of a ray in it
/// is exponentially distributed with mean 1 / density_per_m.
struct Foliage {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double level_radius_m = 1.0;
  double half_height_m = 1.0;
  double density_per_m = 1.0;
};

/// An upright rectangle between two points of the plan. Its outside is to the right of from -> to.
struct Wall {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
  double low_m = 0.0;
  double high_m = 5.0;
};

/// An upright box rotated about the vertical.
struct Box {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_size_m = Eigen::Vector3d::Ones();
  double heading_rad = 0.0;
};

/// An upright cylinder around an object, a cheap first test for rays.
struct Bounds {
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
  double low_m = 0.0;
  double high_m = 0.0;
};
/// The bounds of a stem, for its whole length.
Bounds bounds_of(const Stem& stem);
/// The bounds of foliage.
Bounds bounds_of(const Foliage& foliage);
/// The bounds of a wall.
Bounds bounds_of(const Wall& wall);
/// The bounds of a box.
Bounds bounds_of(const Box& box);

/// The first intersection from outside at a positive distance; none if the ray misses (or starts
/// inside).
std::optional<SurfaceHit> meet(const Ray& ray, const Stem& stem);
/// The same for a wall, from its outside.
std::optional<SurfaceHit> meet(const Ray& ray, const Wall& wall);
/// The same for a box.
std::optional<SurfaceHit> meet(const Ray& ray, const Box& box);
/// The leaf that the ray hits after `free_path` mean free paths in the foliage.
std::optional<SurfaceHit> meet(const Ray& ray, const Foliage& foliage, double free_path);

}  // namespace understory::sim
