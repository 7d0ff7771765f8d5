// Do two maps overlap, and how?
#include <fmt/format.h>

#include "tests/catch.hpp"
#include "tests/map_merge/merge_fixture.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;
using map_merge::align;
using map_merge::Alignment;
using map_merge::AlignmentOutcome;

namespace {

/// What many scenes gave.
struct Tally {
  std::size_t trials = 0;
  std::size_t found = 0;
  std::size_t pairs = 0;
  std::size_t wrong_pairs = 0;
  std::size_t missed_pairs = 0;
  double nees = 0.0;
  double farthest_m = 0.0;

  double mean_nees() const { return nees / static_cast<double>(found); }
};

void add(Tally& tally, const Scene& scene) {
  const Alignment found = align(scene.first.landmarks, scene.second.landmarks);
  ++tally.trials;
  if (!found.found()) return;
  ++tally.found;
  const std::size_t wrong = wrong_pairs(found, scene);
  tally.pairs += found.pairs.size();
  tally.wrong_pairs += wrong;
  tally.missed_pairs += scene.in_common() - (found.pairs.size() - wrong);
  tally.nees += nees_of(found, scene);
  tally.farthest_m = std::max(tally.farthest_m, farthest_m(found, scene));
}

Tally many(const SceneOptions& options, int trials, std::uint64_t seed) {
  Tally tally;
  for (int i = 0; i < trials; ++i) {
    std::mt19937_64 random(seed + static_cast<std::uint64_t>(i));
    add(tally, random_scene(options, random));
  }
  return tally;
}

}  // namespace

TEST_CASE("maps that overlap are found, whatever they have in common", "[map_merge]") {
  struct Row {
    double overlap;
    double common;
    double sigma_m;
    double farthest_m;
  };
  for (const Row& row :
       {Row{1.0, 1.0, 0.02, 0.05}, Row{0.5, 0.64, 0.05, 0.15}, Row{0.2, 0.64, 0.05, 0.3},
        Row{0.5, 0.64, 0.2, 0.6}, Row{1.0, 0.34, 0.1, 0.3}, Row{0.5, 0.34, 0.05, 0.3}}) {
    CAPTURE(row.overlap, row.common, row.sigma_m);
    const SceneOptions options{
        .width_m = 150.0, .overlap = row.overlap, .common = row.common, .sigma_m = row.sigma_m};
    const Tally tally = many(options, 8, 100);
    CHECK(tally.found == tally.trials);
    CHECK(tally.farthest_m < row.farthest_m);
    CHECK(100 * tally.wrong_pairs <= tally.pairs);
    CHECK(100 * tally.missed_pairs <= tally.pairs);
  }
}

TEST_CASE("where little is in common the answer is not sure, and never wrong", "[map_merge]") {
  const SceneOptions options{.width_m = 60.0, .overlap = 0.8, .common = 0.34, .sigma_m = 0.1};
  const Tally tally = many(options, 60, 7);
  WARN(fmt::format("a third of some 40 in common: {} of {} found", tally.found, tally.trials));
  CHECK(tally.found > 0);
  CHECK(tally.found < tally.trials);
  CHECK(tally.farthest_m < 1.0);
}

TEST_CASE("the motion's covariance says how far it is off", "[map_merge]") {
  struct Row {
    double common_sigma_m;
    double common_sigma_rad;
    double low;
    double high;
  };
  // The mean of 60 chi-squared values of three degrees of freedom is within 2.1 and 4.1 with 99.9
  // %. What is common to a map is told apart only as well as its landmarks state it: wider there,
  // and rather too sure by half than by ten.
  for (const Row& row :
       {Row{0.0, 0.0, 1.2, 4.1}, Row{0.1, 0.0, 1.5, 6.0}, Row{0.05, 0.002, 1.5, 6.0}}) {
    CAPTURE(row.common_sigma_m, row.common_sigma_rad);
    const Tally tally = many({.width_m = 100.0,
                              .common_sigma_m = row.common_sigma_m,
                              .common_sigma_rad = row.common_sigma_rad},
                             60, 1000);
    CHECK(tally.found >= tally.trials - 1);
    CHECK(tally.mean_nees() > row.low);
    CHECK(tally.mean_nees() < row.high);
    WARN(fmt::format("common error {} m, {} rad: NEES {:.2f} (3 is exact)", row.common_sigma_m,
                     row.common_sigma_rad, tally.mean_nees()));
  }
}

TEST_CASE("sigmas that are too small or too large do not part the maps", "[map_merge]") {
  for (const double factor : {0.5, 2.0}) {
    CAPTURE(factor);
    const Tally tally = many({.width_m = 100.0, .stated_factor = factor}, 20, 2000);
    CHECK(tally.found == tally.trials);
    CHECK(50 * tally.missed_pairs <= tally.pairs);
    CHECK(tally.mean_nees() < 6.0);
  }
}

TEST_CASE("maps that do not overlap are never taken to", "[map_merge]") {
  std::size_t trials = 0;
  for (const double sigma_m : {0.02, 0.1, 0.2}) {
    for (const double gap : {-0.05, -1.0}) {
      const Tally tally = many({.width_m = 60.0, .overlap = gap, .sigma_m = sigma_m}, 25, 3000);
      CHECK(tally.found == 0);
      trials += tally.trials;
    }
  }
  WARN(fmt::format("{} pairs of maps without overlap: none taken to overlap", trials));
}

TEST_CASE("a forest that repeats itself is ambiguous", "[map_merge]") {
  std::mt19937_64 random(4);
  const SceneOptions options{.width_m = 60.0, .common = 0.9, .sigma_m = 0.02};
  std::vector<Eigen::Vector2d> block = random_trees({.width_m = 60.0, .overlap = 1.0}, random);
  std::vector<Eigen::Vector2d> twice = block;
  for (const Eigen::Vector2d& tree : block) twice.emplace_back(tree.x() + 70.0, tree.y());
  const geometry::SE2 frame(3.0, 4.0, 1.0);
  const MadeMap both = observe(twice, -10.0, 200.0, 1, frame, options, random);
  const MadeMap one = observe(block, -10.0, 200.0, 2, geometry::SE2(), options, random);
  const Alignment found = align(both.landmarks, one.landmarks);
  CHECK_FALSE(found.found());
  CHECK_THAT(found.reason({}), Contains("not sure"));

  // Rows of an orchard, each tree as every other.
  std::vector<Eigen::Vector2d> rows;
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 20; ++k) rows.emplace_back(4.0 * i, 6.0 * k);
  }
  for (int trial = 0; trial < 5; ++trial)
    CHECK_FALSE(align(observe(rows, -1.0, 60.0, 1, frame, options, random).landmarks,
                      observe(rows, 20.0, 90.0, 2, geometry::SE2(), options, random).landmarks)
                    .found());
}

TEST_CASE("maps with next to nothing in them are no error", "[map_merge]") {
  std::mt19937_64 random(5);
  const Scene scene = random_scene({.width_m = 60.0}, random);
  CHECK(align({}, {}).outcome == AlignmentOutcome::kTooFewLandmarks);
  CHECK(align(scene.first.landmarks, {}).outcome == AlignmentOutcome::kTooFewLandmarks);
  const std::span few(scene.second.landmarks.data(), 7);
  CHECK_THAT(align(scene.first.landmarks, few).reason({}), Contains("too few landmarks"));

  // What is not finite, too far away or without covariance does no harm.
  std::vector<model::MapLandmark> odd = scene.second.landmarks;
  for (model::MapLandmark& one : odd) one.covariance_m2.setZero();
  odd[0].position_m.x() = std::numeric_limits<double>::quiet_NaN();
  odd[1].position_m.y() = 1e300;
  odd[2].covariance_m2(0, 0) = std::numeric_limits<double>::infinity();
  const Alignment found = align(scene.first.landmarks, odd);
  REQUIRE(found.found());
  CHECK(farthest_m(found, scene) < 0.3);
  for (const auto& pair : found.pairs) CHECK(pair.second > 2);
  // All in one place: no motion follows, and no time is lost.
  for (model::MapLandmark& one : odd) one.position_m.setZero();
  CHECK_FALSE(align(scene.first.landmarks, odd).found());
}

TEST_CASE("a trunk is never a corner", "[map_merge]") {
  std::mt19937_64 random(6);
  Scene scene = random_scene({.width_m = 100.0, .common = 0.9}, random);
  for (model::MapLandmark& one : scene.second.landmarks) one.kind = model::LandmarkKind::kCorner;
  CHECK_FALSE(align(scene.first.landmarks, scene.second.landmarks).found());
}

TEST_CASE("which map is the first one makes no difference", "[map_merge]") {
  std::mt19937_64 random(8);
  for (int trial = 0; trial < 5; ++trial) {
    SceneOptions options{.width_m = 100.0};
    Scene scene = random_scene(options, random);
    if (trial % 2 == 1) scene.first.landmarks.resize(scene.first.landmarks.size() / 2);
    const Alignment there = align(scene.first.landmarks, scene.second.landmarks);
    const Alignment back = align(scene.second.landmarks, scene.first.landmarks);
    REQUIRE(there.found() == back.found());
    if (!there.found()) continue;
    // Of one and the same pairs, up to the order in which they were found.
    const geometry::SE2 around = there.first_T_second * back.first_T_second;
    const Eigen::Vector2d at = scene.first.landmarks.front().position_m;
    CHECK((around * at - at).norm() < 0.03);
    CHECK(there.pairs.size() + 2 > back.pairs.size());
    CHECK(back.pairs.size() + 2 > there.pairs.size());
  }
}

TEST_CASE("the search tells how far it is, and ends where it is told to", "[map_merge]") {
  std::mt19937_64 random(9);
  const Scene scene = random_scene({.width_m = 60.0, .overlap = -0.5}, random);
  double last = 0.0;
  std::size_t calls = 0;
  align(scene.first.landmarks, scene.second.landmarks, {}, [&](double part) {
    CHECK(part >= last);
    CHECK(part <= 1.0);
    last = part;
    ++calls;
  });
  CHECK(calls > 10);
  CHECK_THROWS_AS(align(scene.first.landmarks, scene.second.landmarks, {},
                        [](double /*part*/) { throw std::runtime_error("enough"); }),
                  std::runtime_error);
}
