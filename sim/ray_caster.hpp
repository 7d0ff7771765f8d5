// Intersections of rays from one point with a world.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/world.hpp"

namespace understory::sim {

/// Result of one ray.
struct RayHit {
  double range_m = 0.0;  ///< The largest range if there is no hit.
  double cosine = 0.0;   ///< Of the angle between the ray and the surface's normal.
  ObjectId object = kGroundObject;
  bool is_hit = false;
};

/// Casts fans of rays: candidates are looked up once per fan, in a grid over the plan. Has working
/// memory; one caster per thread.
class RayCaster {
 public:
  /// `world` must not change afterwards and must outlive the caster.
  explicit RayCaster(const World& world, double tile_m = 4.0);

  /// The nearest hit of each ray from `origin_m` within `max_m`. Fastest if the directions (unit)
  /// have nearly one bearing, like the beams of a spinning laser. `luck` + index of the ray
  /// determines where foliage stops it. hits.size() == directions.size().
  void cast(const Eigen::Vector3d& origin_m, std::span<const Eigen::Vector3d> directions,
            double time_s, double max_m, std::uint64_t luck, std::span<RayHit> hits);
  /// The luck of ray `index` of a fan, for World::meet_object.
  static std::uint64_t luck_of_ray(std::uint64_t luck, std::size_t index);

 private:
  /// A sector of the plan that contains all rays of a fan.
  struct Sector {
    Eigen::Vector2d apex_m = Eigen::Vector2d::Zero();
    Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();
    double right = 0.0;  ///< Tangent of the angle from `ahead`, left positive; right <= left.
    double left = 0.0;
    double reach_m = 0.0;
  };
  struct Candidate {
    double near_m = 0.0;  ///< In the plan.
    double far_m = 0.0;
    double low_m = 0.0;  ///< Relative to the apex, like the following members.
    double high_m = 0.0;
    double radius_m = 0.0;
    Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
    ObjectId object = 0;
  };

  void choose_tile(const Eigen::Vector2d& size_m);
  void fill_grid();
  bool sector_of(const Eigen::Vector3d& origin_m, std::span<const Eigen::Vector3d> directions,
                 double max_m, Sector& sector) const;
  void gather(const Sector& sector, double height_m);
  void gather_tile(int column, int row, const Sector& sector, double height_m);
  void consider(ObjectId object, const Sector& sector, double height_m);
  RayHit cast_one(const Ray& ray, double time_s, double max_m, std::uint64_t luck) const;

  const World& world_;
  double tile_m_;
  Eigen::Vector2d low_m_ = Eigen::Vector2d::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::uint32_t> first_of_tile_;  ///< columns * rows + 1 offsets into order_.
  std::vector<ObjectId> order_;
  std::vector<ObjectId> movers_;            ///< In no tile.
  std::vector<std::uint32_t> seen_in_fan_;  ///< Per object: number of the last fan that tested it.
  std::uint32_t fan_ = 0;
  std::vector<Candidate> candidates_;  ///< Of the present fan, by near_m.
};

}  // namespace understory::sim
