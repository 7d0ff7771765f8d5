// The sensor of the point worlds.
#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "eval/experiments/existence/worlds.hpp"

namespace understory::eval::experiments::existence {

/// Something that hides what is behind it: a wall or the side of a van.
struct Segment {
  Eigen::Vector2f a_m;
  Eigen::Vector2f b_m;
};

/// Whether the way between two places is crossed; `at`: where on it, 0 to 1.
bool crosses(const Segment& segment, const Eigen::Vector2f& from_m, const Eigen::Vector2f& to_m,
             float& at);

/// Looks from places, with per-drive misses, per-look misses and false sightings.
class Observer {
 public:
  Observer(const WorldSetting& setting, const std::vector<Eigen::Vector3f>& points_m,
           std::mt19937_64& random)
      : setting_(setting), points_m_(points_m), random_(random) {}

  /// A drive over these places; `exists` by point.
  DriveLooks drive(double time_s, const std::vector<Eigen::Vector3f>& places_m,
                   const std::vector<Segment>& occluders, const std::vector<bool>& exists);

 private:
  LookEvent look(std::uint32_t point, const Eigen::Vector3f& place_m,
                 const std::vector<Segment>& occluders, bool can_be_seen, bool exists);
  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }

  const WorldSetting& setting_;
  const std::vector<Eigen::Vector3f>& points_m_;
  std::mt19937_64& random_;
};

}  // namespace understory::eval::experiments::existence
