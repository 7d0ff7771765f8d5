// A random forest and frames of it, with the truth.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/level_stems.hpp"

namespace understory::test {

/// What a frame misses and gets wrong.
struct StemErrors {
  double seen_share = 0.65;
  double sigma_m = 0.03;
  double diameter_share = 0.1;
  double range_m = 22.0;
};

/// Stems in a square, uniformly, in 0.02 per square metre.
class StemScene {
 public:
  StemScene(std::mt19937_64& random, double side_m) : random_(random) {
    std::uniform_real_distribution<double> place(0.0, side_m);
    std::normal_distribution<double> log_diameter(-1.3, 0.4);
    const auto count = static_cast<std::size_t>(0.02 * side_m * side_m);
    for (std::size_t i = 0; i < count; ++i) {
      const double x = place(random);
      const double y = place(random);
      stems_.push_back({{x, y}, std::exp(log_diameter(random))});
    }
  }

  /// A frame; what it does not see is drawn anew for each one.
  std::vector<place_recognition::LevelStem> frame(const geometry::SE2& world_T_level,
                                                  const StemErrors& errors) {
    std::uniform_real_distribution<double> luck(0.0, 1.0);
    std::normal_distribution<double> noise(0.0, 1.0);
    std::vector<place_recognition::LevelStem> seen;
    for (const auto& stem : stems_) {
      const Eigen::Vector2d at = world_T_level.inverse() * stem.position_m;
      if (at.norm() > errors.range_m || luck(random_) > errors.seen_share) continue;
      const double x = noise(random_);
      const double y = noise(random_);
      seen.push_back({at + errors.sigma_m * Eigen::Vector2d(x, y),
                      stem.diameter_m * (1.0 + errors.diameter_share * noise(random_))});
    }
    return seen;
  }

  const std::vector<place_recognition::LevelStem>& stems() const { return stems_; }

 private:
  std::mt19937_64& random_;
  std::vector<place_recognition::LevelStem> stems_;
};

}  // namespace understory::test
