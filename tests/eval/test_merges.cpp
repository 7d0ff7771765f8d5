// eval map-merge: what it counts.
#include <algorithm>
#include <random>

#include "eval/experiments/merges/pairs.hpp"
#include "sim/forest.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments;

namespace {

std::vector<Eigen::Vector2d> forest() {
  std::mt19937_64 random(3);
  sim::ForestParameters parameters;
  parameters.side_m = 200.0;
  parameters.min_distance_m = 5.0;
  return sim::make_forest(parameters, random).trunks_m;
}

}  // namespace

TEST_CASE("map-merge cuts maps whose trees it knows", "[eval]") {
  const auto trees = merges::unchanged(forest());
  for (const double overlap : {0.5, -0.1}) {
    const auto pair = merges::cut_maps(trees, {.overlap = overlap, .sigma_m = 0.01}, 5);
    CHECK(pair.overlaps == (overlap > 0.0));
    std::size_t common = 0;
    for (std::size_t i = 0; i < pair.second.trees.size(); ++i) {
      const auto& b = pair.second.map.landmarks[i].landmark;
      for (std::size_t k = 0; k < pair.first.trees.size(); ++k) {
        if (pair.first.trees[k] != pair.second.trees[i]) continue;
        ++common;
        const auto& a = pair.first.map.landmarks[k].landmark;
        CHECK((a.position_m - pair.first_T_second * b.position_m).norm() < 0.1);
      }
    }
    CHECK((common > 20) == pair.overlaps);
  }
}

TEST_CASE("map-merge scores merges", "[eval]") {
  const auto trees = merges::unchanged(forest());
  auto pair = merges::cut_maps(trees, {.overlap = 0.6}, 6);
  const auto right = merges::merge_trial(pair);
  CHECK(right.merged);
  CHECK_FALSE(right.wrong);
  CHECK(right.doubled == 0);
  CHECK(right.offset_m < 0.2);
  // What is called another truth is a wrong merge.
  pair.first_T_second = geometry::SE2(2.0, 0.0, 0.0) * pair.first_T_second;
  CHECK(merges::merge_trial(pair).wrong);
  // A landmark that is there twice is one too many before and after.
  auto twice = pair.first.map.landmarks.back();
  twice.landmark.id += 1;
  twice.landmark.position_m.x() += 0.8;
  pair.first.map.landmarks.push_back(twice);
  pair.first.trees.push_back(pair.first.trees.back());
  CHECK(merges::merge_trial(pair).doubled_before == 1);
  CHECK(merges::merge_trial(pair).doubled == 1);
  CHECK_FALSE(merges::merge_trial(merges::cut_maps(trees, {.overlap = -0.2}, 7)).merged);
}

TEST_CASE("map-merge merges the maps of two drives", "[eval]") {
  const std::atomic<bool> stop = false;
  int doubled = 0;
  int landmarks = 0;
  for (std::uint64_t seed = 11; seed <= 14; ++seed) {
    CAPTURE(seed);
    const auto pair = merges::drive_maps({.side_m = 200.0}, seed, stop);
    CHECK(pair.first.map.landmarks.size() > 50);
    const auto trial = merges::merge_trial(pair);
    CHECK(trial.merged);
    CHECK_FALSE(trial.wrong);
    doubled += static_cast<int>(trial.doubled);
    landmarks += static_cast<int>(trial.landmarks);
  }
  CHECK(100 * doubled <= landmarks);
}

TEST_CASE("map-merge knows the trees of two censuses apart", "[eval]") {
  const auto visits =
      merges::visits_of({{0.0, 0.0}, {1.0, 0.0}, {2.0, 2.0}}, {{1.0, 0.0}, {3.0, 1.0}});
  CHECK(visits.trees_m.size() == 4);
  CHECK(std::count(visits.at_first.begin(), visits.at_first.end(), true) == 3);
  CHECK(std::count(visits.at_second.begin(), visits.at_second.end(), true) == 2);
  const auto pair = merges::cut_maps(visits, {.overlap = 1.0, .common = 1.0, .width_m = 10.0}, 1);
  CHECK(pair.first.trees.size() <= 3);
  for (const std::size_t tree : pair.second.trees) CHECK(visits.at_second[tree]);
}
