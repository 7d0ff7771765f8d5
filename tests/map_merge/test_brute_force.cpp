// The search against one that tries every motion.
#include <numbers>

#include "tests/catch.hpp"
#include "tests/map_merge/merge_fixture.hpp"

using namespace understory;
using namespace understory::test;

namespace {

constexpr double kGate_m = 0.25;

std::size_t explained(const Scene& scene, const geometry::SE2& first_T_second) {
  std::size_t count = 0;
  for (const model::MapLandmark& b : scene.second.landmarks) {
    const Eigen::Vector2d at = first_T_second * b.position_m;
    count += static_cast<std::size_t>(std::ranges::any_of(
        scene.first.landmarks,
        [&](const model::MapLandmark& a) { return (a.position_m - at).norm() < kGate_m; }));
  }
  return count;
}

/// The motion that takes one pair of landmarks exactly to another, as nearly as it goes.
geometry::SE2 motion_of(const Eigen::Vector2d& a1, const Eigen::Vector2d& a2,
                        const Eigen::Vector2d& b1, const Eigen::Vector2d& b2) {
  const Eigen::Vector2d a = a2 - a1;
  const Eigen::Vector2d b = b2 - b1;
  const double angle = std::atan2(a.y(), a.x()) - std::atan2(b.y(), b.x());
  const geometry::SE2 turn(0.0, 0.0, angle);
  return {0.5 * (a1 + a2) - turn * Eigen::Vector2d(0.5 * (b1 + b2)), angle};
}

/// Of all motions that take two landmarks of one map to two of the other, the one that explains
/// most.
std::pair<std::size_t, geometry::SE2> best_of_all(const Scene& scene) {
  std::pair<std::size_t, geometry::SE2> best{0, {}};
  const auto& first = scene.first.landmarks;
  const auto& second = scene.second.landmarks;
  for (std::size_t i = 0; i < first.size(); ++i) {
    for (std::size_t k = 0; k < first.size(); ++k) {
      const double side_m = (first[i].position_m - first[k].position_m).norm();
      if (i == k || side_m < 10.0) continue;
      for (std::size_t m = 0; m < second.size(); ++m) {
        for (std::size_t n = m + 1; n < second.size(); ++n) {
          if (std::abs((second[m].position_m - second[n].position_m).norm() - side_m) > 0.1)
            continue;
          const geometry::SE2 motion = motion_of(first[i].position_m, first[k].position_m,
                                                 second[m].position_m, second[n].position_m);
          const std::size_t count = explained(scene, motion);
          if (count > best.first) best = {count, motion};
        }
      }
    }
  }
  return best;
}

}  // namespace

TEST_CASE("what is found is what trying every motion finds", "[map_merge]") {
  std::size_t found_by_both = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const Scene scene = random_scene(
        {.width_m = 40.0, .overlap = seed % 2 == 0 ? 0.8 : -0.1, .common = 0.8, .sigma_m = 0.03},
        random);
    const auto found = map_merge::align(scene.first.landmarks, scene.second.landmarks);
    const auto [count, motion] = best_of_all(scene);
    if (!found.found()) continue;

    ++found_by_both;
    CHECK(found.pairs.size() + 2 >= count);
    const Eigen::Vector2d middle = scene.second.landmarks.front().position_m;
    CHECK((found.first_T_second * middle - motion * middle).norm() < 0.5);
    CHECK(seed % 2 == 0);
  }
  CHECK(found_by_both == 4);
}
