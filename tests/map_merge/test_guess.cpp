// Two maps of which somebody says how they lie to each other.
#include <fmt/format.h>

#include "tests/catch.hpp"
#include "tests/map_merge/merge_fixture.hpp"

using namespace understory;
using namespace understory::test;
using map_merge::Alignment;
using map_merge::AlignmentOutcome;

namespace {

/// What a person knows of it, with an error of its own.
geometry::SE2WithCovariance said(const Scene& scene, std::mt19937_64& random,
                                 const Eigen::Vector3d& off = Eigen::Vector3d::Zero()) {
  // Of the first landmark of the second map, where the person stood.
  std::normal_distribution<double> normal;
  const geometry::SE2 second_T_here(scene.second.landmarks.front().position_m, 0.3);
  const Eigen::Vector3d sigma(0.5, 0.5, 0.02);
  Eigen::Vector3d error;
  for (int k = 0; k < 3; ++k) error[k] = sigma[k] * normal(random) + off[k];
  const geometry::SE2WithCovariance first_T_here{
      scene.first_T_second * second_T_here * geometry::SE2::Exp(error),
      sigma.array().square().matrix().asDiagonal()};
  return compound(first_T_here, {second_T_here.inverse(), Eigen::Matrix3d::Zero()});
}

Alignment near(const Scene& scene, const geometry::SE2WithCovariance& guess) {
  return map_merge::align_near(guess, scene.first.landmarks, scene.second.landmarks);
}

}  // namespace

TEST_CASE("what is too thin to be found is found where somebody says where", "[map_merge]") {
  SceneOptions thin;
  thin.overlap = 0.2;
  thin.width_m = 60.0;
  std::size_t alone = 0;
  std::size_t with_word = 0;
  double nees = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(900 + seed);
    const Scene scene = random_scene(thin, random);
    if (map_merge::align(scene.first.landmarks, scene.second.landmarks).found()) ++alone;
    const Alignment found = near(scene, said(scene, random));
    CAPTURE(seed, found.reason({}));
    if (!found.found()) continue;
    ++with_word;
    nees += nees_of(found, scene);
    CHECK(wrong_pairs(found, scene) <= 1);
    CHECK(error_of(found, scene).head<2>().norm() < 2.0);
  }
  WARN(fmt::format("of 20: {} alone, {} with a guess, mean NEES {:.2f}", alone, with_word,
                   nees / static_cast<double>(with_word)));
  CHECK(with_word >= alone + 5);
}

TEST_CASE("a guess that the landmarks contradict is not taken", "[map_merge]") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    std::mt19937_64 random(950 + seed);
    const Scene scene = random_scene({}, random);
    REQUIRE(near(scene, said(scene, random)).found());
    // Twelve standard deviations away.
    CHECK_FALSE(near(scene, said(scene, random, {6.0, 0.0, 0.0})).found());
    CHECK_FALSE(near(scene, said(scene, random, {0.0, -8.0, 0.3})).found());
  }
}

TEST_CASE("where nothing is in common a guess finds nothing", "[map_merge]") {
  SceneOptions apart;
  apart.overlap = -0.2;
  apart.width_m = 100.0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    std::mt19937_64 random(980 + seed);
    const Scene scene = random_scene(apart, random);
    CHECK_FALSE(near(scene, said(scene, random)).found());
  }
  CHECK(map_merge::align_near({}, {}, {}).outcome == AlignmentOutcome::kTooFewLandmarks);
}
