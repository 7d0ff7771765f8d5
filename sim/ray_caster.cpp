#include "sim/ray_caster.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "sim/hash_random.hpp"

namespace understory::sim {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

RayCaster::RayCaster(const World& world, double tile_m) : world_(world), tile_m_(tile_m) {
  seen_in_fan_.assign(world.object_count(), 0);
  fill_grid();
}

/// Larger tiles if a large world would need too many.
void RayCaster::choose_tile(const Eigen::Vector2d& size_m) {
  constexpr double kMostTiles = 16e6;
  tile_m_ = std::max(tile_m_, std::sqrt(size_m.x() * size_m.y() / kMostTiles));
  columns_ = static_cast<int>(std::floor(size_m.x() / tile_m_)) + 1;
  rows_ = static_cast<int>(std::floor(size_m.y() / tile_m_)) + 1;
}

void RayCaster::fill_grid() {
  Eigen::Vector2d high_m = Eigen::Vector2d::Zero();
  bool is_first = true;
  for (ObjectId i = 0; i < world_.object_count(); ++i) {
    if (world_.moves(i)) {
      movers_.push_back(i);
      continue;
    }
    const Bounds& b = world_.bounds(i);
    const Eigen::Vector2d low = b.centre_m.array() - b.radius_m;
    const Eigen::Vector2d high = b.centre_m.array() + b.radius_m;
    low_m_ = is_first ? low : low_m_.cwiseMin(low).eval();
    high_m = is_first ? high : high_m.cwiseMax(high).eval();
    is_first = false;
  }

  choose_tile(high_m - low_m_);
  const auto for_each_tile = [&](auto visit) {
    for (ObjectId i = 0; i < world_.object_count(); ++i) {
      if (world_.moves(i)) continue;
      const Bounds& b = world_.bounds(i);
      const Eigen::Array2d at = (b.centre_m - low_m_).array();
      const Eigen::Array2i first = ((at - b.radius_m) / tile_m_).floor().cast<int>();
      const Eigen::Array2i last = ((at + b.radius_m) / tile_m_).floor().cast<int>();
      for (int row = std::max(0, first.y()); row <= std::min(rows_ - 1, last.y()); ++row) {
        for (int c = std::max(0, first.x()); c <= std::min(columns_ - 1, last.x()); ++c) {
          visit(static_cast<std::size_t>(row) * columns_ + c, i);
        }
      }
    }
  };

  first_of_tile_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  for_each_tile([&](std::size_t tile, ObjectId /*object*/) { ++first_of_tile_[tile + 1]; });
  for (std::size_t t = 1; t < first_of_tile_.size(); ++t) {
    first_of_tile_[t] += first_of_tile_[t - 1];
  }

  order_.resize(first_of_tile_.back());
  std::vector<std::uint32_t> next(first_of_tile_.begin(), first_of_tile_.end() - 1);
  for_each_tile([&](std::size_t tile, ObjectId object) { order_[next[tile]++] = object; });
}

bool RayCaster::sector_of(const Eigen::Vector3d& origin_m,
                          std::span<const Eigen::Vector3d> directions, double max_m,
                          Sector& sector) const {
  sector.apex_m = origin_m.head<2>();
  sector.reach_m = max_m;
  const double length = directions.front().head<2>().norm();
  if (length < 1e-9) return false;

  sector.ahead = directions.front().head<2>() / length;
  sector.right = sector.left = 0.0;
  for (const Eigen::Vector3d& direction : directions) {
    const double along = sector.ahead.dot(direction.head<2>());
    const double aside = cross(sector.ahead, direction.head<2>());
    if (std::abs(aside) >= 0.2 * along) return false;
    sector.right = std::min(sector.right, aside / along);
    sector.left = std::max(sector.left, aside / along);
  }

  return true;
}

void RayCaster::consider(ObjectId object, const Sector& sector, double height_m) {
  if (seen_in_fan_[object] == fan_) return;
  seen_in_fan_[object] = fan_;
  const Bounds& b = world_.bounds(object);
  const Eigen::Vector2d to_centre = b.centre_m - sector.apex_m;
  const double along = sector.ahead.dot(to_centre);
  if (along < -b.radius_m) return;

  const double aside = cross(sector.ahead, to_centre);
  const double r = b.radius_m + 1e-9;
  if (aside - sector.left * along > r * std::sqrt(1.0 + sector.left * sector.left) ||
      sector.right * along - aside > r * std::sqrt(1.0 + sector.right * sector.right)) {
    return;
  }

  const double distance_m = to_centre.norm();
  if (distance_m - r > sector.reach_m) return;

  candidates_.push_back({std::max(0.0, distance_m - r), distance_m + r, b.low_m - height_m,
                         b.high_m - height_m, r, to_centre, object});
}

void RayCaster::gather_tile(int column, int row, const Sector& sector, double height_m) {
  const std::size_t tile = static_cast<std::size_t>(row) * columns_ + column;
  for (std::uint32_t k = first_of_tile_[tile]; k < first_of_tile_[tile + 1]; ++k) {
    consider(order_[k], sector, height_m);
  }
}

/// Follows the longer axis of the sector, strip of tiles by strip.
void RayCaster::gather(const Sector& sector, double height_m) {
  candidates_.clear();
  ++fan_;
  for (const ObjectId mover : movers_) consider(mover, sector, height_m);
  const int u = std::abs(sector.ahead.x()) >= std::abs(sector.ahead.y()) ? 0 : 1;
  const int v = 1 - u;
  const Eigen::Vector2d aside(-sector.ahead.y(), sector.ahead.x());
  const Eigen::Vector2d right = sector.ahead + sector.right * aside;

  const Eigen::Vector2d left = sector.ahead + sector.left * aside;
  const double u0 = sector.apex_m[u];
  const double v0 = sector.apex_m[v];
  const double right_slope = right[v] / right[u];
  const double left_slope = left[v] / left[u];
  const double reach = sector.reach_m * std::max(std::abs(right[u]), std::abs(left[u])) *
                       (sector.ahead[u] < 0 ? -1 : 1);
  const int u_count = u == 0 ? columns_ : rows_;

  const int v_count = u == 0 ? rows_ : columns_;
  const double from = std::min(u0, u0 + reach);
  const double to = std::max(u0, u0 + reach);

  const auto tile_of = [&](double x, int axis) {
    return static_cast<int>(std::floor((x - low_m_[axis]) / tile_m_));
  };

  const int last = std::min(u_count - 1, tile_of(to, u));
  for (int i = std::max(0, tile_of(from, u)); i <= last; ++i) {
    const double a = std::max(from, low_m_[u] + i * tile_m_) - u0;
    const double b = std::min(to, low_m_[u] + (i + 1) * tile_m_) - u0;
    const auto [low, high] =
        std::minmax({right_slope * a, right_slope * b, left_slope * a, left_slope * b});
    const int v_last = std::min(v_count - 1, tile_of(v0 + high, v));
    for (int j = std::max(0, tile_of(v0 + low, v)); j <= v_last; ++j) {
      gather_tile(u == 0 ? i : j, u == 0 ? j : i, sector, height_m);
    }
  }

  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& p, const Candidate& q) {
    return p.near_m != q.near_m ? p.near_m < q.near_m : p.object < q.object;
  });
}

RayHit RayCaster::cast_one(const Ray& ray, double time_s, double max_m, std::uint64_t luck) const {
  RayHit hit{max_m, 0.0, kGroundObject, false};
  const double level = ray.direction.head<2>().norm();
  const Eigen::Vector2d ahead = ray.direction.head<2>() / std::max(level, 1e-12);
  const double climb = ray.direction.z() / std::max(level, 1e-12);

  for (const Candidate& c : candidates_) {
    if (c.near_m > hit.range_m * level) break;
    const double z_near = climb * c.near_m;
    const double z_far = climb * c.far_m;
    if (std::max(z_near, z_far) < c.low_m || std::min(z_near, z_far) > c.high_m) continue;
    if (std::abs(cross(ahead, c.centre_m)) > c.radius_m) continue;
    const auto met = world_.meet_object(ray, c.object, time_s, luck);
    if (met && met->range_m < hit.range_m) hit = {met->range_m, met->cosine, c.object, true};
  }

  const auto ground = world_.meet_ground(ray, hit.range_m, luck);
  if (ground) hit = {ground->range_m, ground->cosine, kGroundObject, true};

  return hit;
}

std::uint64_t RayCaster::luck_of_ray(std::uint64_t luck, std::size_t index) {
  return mixed(luck + index);
}

void RayCaster::cast(const Eigen::Vector3d& origin_m, std::span<const Eigen::Vector3d> directions,
                     double time_s, double max_m, std::uint64_t luck, std::span<RayHit> hits) {
  assert(hits.size() == directions.size());
  if (directions.empty()) return;

  Sector sector;
  if (sector_of(origin_m, directions, max_m, sector)) {
    gather(sector, origin_m.z());
    for (std::size_t i = 0; i < directions.size(); ++i) {
      hits[i] = cast_one({origin_m, directions[i]}, time_s, max_m, luck_of_ray(luck, i));
    }
    return;
  }

  // Without a common bearing: one by one. A vertical ray meets the objects at the apex.
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (!sector_of(origin_m, directions.subspan(i, 1), max_m, sector)) {
      sector.ahead = Eigen::Vector2d::UnitX();
      sector.right = sector.left = 0.0;
    }
    gather(sector, origin_m.z());
    hits[i] = cast_one({origin_m, directions[i]}, time_s, max_m, luck_of_ray(luck, i));
  }
}

}  // namespace understory::sim
