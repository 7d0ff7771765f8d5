#include "sim/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory::sim {

Bounds bounds_of(const Stem& stem) {
  const Eigen::Vector3d top = stem.centre_at(stem.length_m);
  const double widest = std::max(stem.base_radius_m, stem.radius_at(stem.length_m));
  return {0.5 * (stem.base_m + top).head<2>(), 0.5 * (top - stem.base_m).head<2>().norm() + widest,
          stem.base_m.z() - widest, top.z() + widest};
}

Bounds bounds_of(const Foliage& foliage) {
  return {foliage.centre_m.head<2>(), foliage.level_radius_m,
          foliage.centre_m.z() - foliage.half_height_m,
          foliage.centre_m.z() + foliage.half_height_m};
}

Bounds bounds_of(const Wall& wall) {
  return {0.5 * (wall.from_m + wall.to_m), 0.5 * (wall.to_m - wall.from_m).norm(), wall.low_m,
          wall.high_m};
}

Bounds bounds_of(const Box& box) {
  return {box.centre_m.head<2>(), box.half_size_m.head<2>().norm(),
          box.centre_m.z() - box.half_size_m.z(), box.centre_m.z() + box.half_size_m.z()};
}

std::optional<SurfaceHit> meet(const Ray& ray, const Stem& stem) {
  // |w + t d|^2 - s^2 = r(s)^2 with s = (w + t d) . axis, solved for t.
  const Eigen::Vector3d w = ray.origin_m - stem.base_m;
  const double along_speed = ray.direction.dot(stem.axis);
  const double along = w.dot(stem.axis);
  const double radius = stem.radius_at(along);
  const double a = 1.0 - along_speed * along_speed * (1.0 + stem.taper * stem.taper);
  const double b = w.dot(ray.direction) - along * along_speed + stem.taper * along_speed * radius;
  const double c = w.squaredNorm() - along * along - radius * radius;

  const double discriminant = b * b - a * c;
  if (a <= 1e-12 || c <= 0.0 || discriminant < 0.0) return std::nullopt;

  const double t = (-b - std::sqrt(discriminant)) / a;
  if (t <= 0.0) return std::nullopt;

  const double s = along + t * along_speed;
  if (s < 0.0 || s > stem.length_m) return std::nullopt;

  // d(implicit)/dt at the root is 2 sqrt(discriminant); the gradient's norm is 2 r sqrt(1 + k^2).
  const double slant = stem.radius_at(s) * std::sqrt(1.0 + stem.taper * stem.taper);
  return SurfaceHit{t, slant > 0.0 ? std::min(1.0, std::sqrt(discriminant) / slant) : 1.0};
}

std::optional<SurfaceHit> meet(const Ray& ray, const Wall& wall) {
  const Eigen::Vector2d side = wall.to_m - wall.from_m;
  const Eigen::Vector2d to_wall = wall.from_m - ray.origin_m.head<2>();
  const auto cross = [](const auto& p, const auto& q) { return p.x() * q.y() - p.y() * q.x(); };
  const double det = cross(ray.direction, side);
  if (std::abs(det) < 1e-12) return std::nullopt;
  const double t = cross(to_wall, side) / det;
  const double share = cross(to_wall, ray.direction) / det;
  if (t <= 0.0 || share < 0.0 || share > 1.0) return std::nullopt;
  const double z = ray.origin_m.z() + t * ray.direction.z();
  if (z < wall.low_m || z > wall.high_m) return std::nullopt;
  return SurfaceHit{t, std::abs(det) / side.norm()};
}

std::optional<SurfaceHit> meet(const Ray& ray, const Box& box) {
  const double cosine = std::cos(box.heading_rad);
  const double sine = std::sin(box.heading_rad);
  const auto turned = [&](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x(), v.z());
  };

  const Eigen::Vector3d o = turned(ray.origin_m - box.centre_m);
  const Eigen::Vector3d d = turned(ray.direction);
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  double facing = 1.0;

  for (int i = 0; i < 3; ++i) {
    if (std::abs(d[i]) < 1e-12) {
      if (std::abs(o[i]) > box.half_size_m[i]) return std::nullopt;
      continue;
    }
    const double first = (-std::copysign(box.half_size_m[i], d[i]) - o[i]) / d[i];
    const double last = (std::copysign(box.half_size_m[i], d[i]) - o[i]) / d[i];
    if (first > enter) {
      enter = first;
      facing = std::abs(d[i]);
    }
    leave = std::min(leave, last);
  }

  if (enter <= 0.0 || enter > leave) return std::nullopt;
  return SurfaceHit{enter, facing};
}

std::optional<SurfaceHit> meet(const Ray& ray, const Foliage& foliage, double free_path) {
  // Stretched to a unit sphere.
  const Eigen::Vector3d scale(1.0 / foliage.level_radius_m, 1.0 / foliage.level_radius_m,
                              1.0 / foliage.half_height_m);
  const Eigen::Vector3d o = (ray.origin_m - foliage.centre_m).cwiseProduct(scale);
  const Eigen::Vector3d d = ray.direction.cwiseProduct(scale);
  const double a = d.squaredNorm();
  const double b = o.dot(d);
  const double discriminant = b * b - a * (o.squaredNorm() - 1.0);
  if (discriminant <= 0.0) return std::nullopt;

  const double root = std::sqrt(discriminant);
  const double leave = (-b + root) / a;
  const double t = std::max(0.0, (-b - root) / a) + free_path / foliage.density_per_m;
  if (t >= leave) return std::nullopt;

  return SurfaceHit{t, 0.7};
}

}  // namespace understory::sim
