// Two maps as one: what becomes of each landmark.
#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "tests/catch.hpp"
#include "tests/map_merge/merge_fixture.hpp"

using namespace understory;
using namespace understory::test;
using map_file::StoredMap;
using map_merge::Alignment;
using map_merge::MergedMaps;

namespace {

struct Merge {
  Scene scene;
  StoredMap first;
  StoredMap second;
  Alignment alignment;
  MergedMaps merged;

  explicit Merge(const SceneOptions& options, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    scene = random_scene(options, random);
    first = stored(scene.first, 1);
    second = stored(scene.second, 2);
    merge();
  }
  void merge() {
    alignment = map_merge::align(map_merge::landmarks_of(first), map_merge::landmarks_of(second));
    REQUIRE(alignment.found());
    merged = map_merge::fuse(first, second, alignment);
  }

  /// Trees that are in the merged map twice.
  std::size_t doubled() const {
    std::map<model::LandmarkId, std::set<std::size_t>> trees;
    for (std::size_t i = 0; i < first.landmarks.size(); ++i)
      trees[first.landmarks[i].landmark.id].insert(scene.first.trees[i]);
    for (const auto& [old_id, new_id] : merged.renamed) {
      const std::uint64_t counter = old_id - map_file::landmark_id(2, 0);
      trees[new_id].insert(scene.second.trees[counter - 1]);
    }
    std::map<std::size_t, std::size_t> times;
    for (const auto& [id, of_landmark] : trees) {
      for (const std::size_t tree : of_landmark) ++times[tree];
    }
    return static_cast<std::size_t>(
        std::ranges::count_if(times, [](const auto& one) { return one.second > 1; }));
  }
};

}  // namespace

TEST_CASE("a merged map has each tree once", "[map_merge]") {
  std::size_t doubled = 0;
  std::size_t landmarks = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Merge one({.width_m = 120.0, .overlap = 0.25 * static_cast<double>(1 + seed % 4)}, seed);
    doubled += one.doubled();
    landmarks += one.merged.map.landmarks.size();
    CHECK(map_file::fault_of(one.merged.map).empty());
    CHECK(map_file::fault_of(one.merged.trajectory).empty());
    CHECK(one.merged.map.landmarks.size() == one.first.landmarks.size() + one.merged.added);
    CHECK(one.second.landmarks.size() == one.merged.fused + one.merged.added);
    CHECK(one.merged.renamed.size() == one.second.landmarks.size());
  }
  CHECK(200 * doubled <= landmarks);
}

TEST_CASE("ids of the first map stay, the others go on behind them", "[map_merge]") {
  Merge one({.width_m = 80.0}, 9);
  one.first.landmarks.back().landmark.id = map_file::landmark_id(1, 5000);
  one.merge();
  for (std::size_t i = 0; i < one.first.landmarks.size(); ++i)
    CHECK(one.merged.map.landmarks[i].landmark.id == one.first.landmarks[i].landmark.id);
  for (std::size_t i = 0; i < one.merged.added; ++i) {
    const auto& added = one.merged.map.landmarks[one.first.landmarks.size() + i];
    CHECK(added.landmark.id == map_file::landmark_id(1, 5001 + i));
  }
  std::set<model::LandmarkId> targets;
  for (const auto& [old_id, new_id] : one.merged.renamed) CHECK(targets.insert(new_id).second);
}

TEST_CASE("fused landmarks are as much better as they say", "[map_merge]") {
  // Of independent errors: the mean of both, half of the variance; in the first map's frame.
  double chi2 = 0.0;
  double variances = 0.0;
  std::size_t count = 0;
  for (std::uint64_t seed = 20; seed < 26; ++seed) {
    const SceneOptions options{.width_m = 120.0, .overlap = 0.9, .sigma_m = 0.1};
    const Merge one(options, seed);
    for (const map_merge::LandmarkPair& pair : one.alignment.pairs) {
      const auto& a = one.first.landmarks[pair.first].landmark;
      const auto& b = one.second.landmarks[pair.second].landmark;
      const auto& fused = one.merged.map.landmarks[pair.first].landmark;
      // Lies between the two, nearer to none than the information says.
      const Eigen::Vector2d moved = one.alignment.first_T_second * b.position_m;
      CHECK((fused.position_m - 0.5 * (a.position_m + moved)).norm() < 1e-3);
      CHECK(fused.covariance_m2.trace() < a.covariance_m2.trace());
      variances += fused.covariance_m2.trace() / a.covariance_m2.trace();
      // The distance from one to the mean has a quarter of the difference's variance.
      const Eigen::Vector2d off = fused.position_m - a.position_m;
      chi2 += off.squaredNorm() / (0.5 * options.sigma_m * options.sigma_m);
      ++count;
    }
  }
  const auto number = static_cast<double>(count);
  CHECK(variances / number > 0.49);
  CHECK(variances / number < 0.6);
  CHECK(chi2 / number == Approx(2.0).epsilon(0.1));
}

TEST_CASE("an error that is common to a map is not made smaller", "[map_merge]") {
  const Merge one({.width_m = 100.0, .overlap = 0.8, .sigma_m = 0.02, .common_sigma_m = 0.3}, 31);
  for (const map_merge::LandmarkPair& pair : one.alignment.pairs) {
    const Eigen::Matrix2d before = one.first.landmarks[pair.first].landmark.covariance_m2;
    const Eigen::Matrix2d after = one.merged.map.landmarks[pair.first].landmark.covariance_m2;
    CHECK(after.trace() < before.trace());
    CHECK(after.trace() > 0.9 * before.trace());
  }
}

TEST_CASE("counts are added, radii averaged by them, the younger map knows what is there",
          "[map_merge]") {
  Merge one({.width_m = 80.0}, 40);
  const map_merge::LandmarkPair pair = one.alignment.pairs.front();
  auto& a = one.first.landmarks[pair.first];
  auto& b = one.second.landmarks[pair.second];
  const auto fused = [&] {
    return map_merge::fuse(one.first, one.second, one.alignment).map.landmarks[pair.first];
  };
  a.landmark.observation_count = 30;
  b.landmark.observation_count = 10;
  a.landmark.radius_m = 0.2;
  b.landmark.radius_m = 0.1;
  a.existence = 0.9;
  b.existence = 0.2;
  one.first.created_utime = 5;
  CHECK(fused().landmark.observation_count == 40);
  CHECK(fused().landmark.radius_m == Approx(0.175));
  CHECK(fused().existence == 0.9);
  one.second.created_utime = 6;
  CHECK(fused().existence == 0.2);

  b.existence.reset();
  b.landmark.radius_m = 0.0;
  b.landmark.observation_count = std::numeric_limits<std::uint32_t>::max();
  CHECK(fused().existence == 0.9);
  CHECK(fused().landmark.radius_m == 0.2);
  CHECK(fused().landmark.observation_count == std::numeric_limits<std::uint32_t>::max());
  a.landmark.covariance_m2.setZero();  // Not computed: taken as the parameters say.
  CHECK(fused().landmark.covariance_m2.trace() > 0.0);
}

TEST_CASE("states of existence follow their landmarks, of a pair the later one stays",
          "[map_merge]") {
  Merge one({.width_m = 80.0}, 45);
  const map_merge::LandmarkPair early = one.alignment.pairs[0];
  const map_merge::LandmarkPair late = one.alignment.pairs[1];
  const auto row = [](const map_file::StoredLandmark& of, model::Utime utime, double probability) {
    return map_file::ExistenceRow{
        {of.landmark.id, probability, true}, utime, std::to_string(of.landmark.id)};
  };
  map_file::StoredExistence first{10, "first", {}};
  map_file::StoredExistence second{20, "second", {}};
  for (std::size_t i = 0; i < one.first.landmarks.size(); ++i)
    first.landmarks.push_back(row(one.first.landmarks[i], i == late.first ? 30 : 5, 0.25));
  for (const auto& landmark : one.second.landmarks)
    second.landmarks.push_back(row(landmark, 15, 0.75));
  map_file::give_existence(one.first, first);
  map_file::give_existence(one.second, second);
  one.merge();

  const StoredMap& map = one.merged.map;
  CHECK(map_file::fault_of(map).empty());
  CHECK_FALSE(one.merged.trajectory.existence);
  REQUIRE(map.existence);
  CHECK(map.existence->learned == "second");
  CHECK(map.existence->utime == 20);
  REQUIRE(map.existence->landmarks.size() == map.landmarks.size());
  const auto& states = map.existence->landmarks;
  CHECK(states[early.first].state ==
        std::to_string(one.second.landmarks[early.second].landmark.id));
  CHECK(map.landmarks[early.first].existence == 0.75);
  CHECK(states[late.first].state == std::to_string(one.first.landmarks[late.first].landmark.id));
  CHECK(map.landmarks[late.first].existence == 0.25);
  for (const auto& [old_id, new_id] : one.merged.renamed) {
    const auto at = std::ranges::lower_bound(states, new_id, {},
                                             [](const auto& state) { return state.existence.id; });
    REQUIRE(at != states.end());
    CHECK(at->existence.id == new_id);
    if (new_id != one.first.landmarks[late.first].landmark.id)
      CHECK(at->state == std::to_string(old_id));
  }

  // One side alone.
  one.first.existence.reset();
  one.merge();
  CHECK(one.merged.map.existence->landmarks.size() == one.second.landmarks.size());
  one.second.existence.reset();
  one.merge();
  CHECK_FALSE(one.merged.map.existence);
}

TEST_CASE("trajectories are kept apart, each under its number, in one frame", "[map_merge]") {
  Merge one({.width_m = 80.0}, 50);
  one.second.submap_borders.push_back({3, {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}});
  one.second.loop_closures.push_back({1, 4, {3.0, 1.0}, {12.0, 4.0}});
  one.second.keyframes[1].covariance.setZero();
  one.merge();
  const auto& moved = one.merged.trajectory;
  const geometry::SE2& motion = one.alignment.first_T_second;
  CHECK(moved.map_id == 2);
  CHECK(moved.landmarks.empty());
  CHECK(one.merged.map.keyframes.size() == one.first.keyframes.size());
  REQUIRE(moved.keyframes.size() == one.second.keyframes.size());
  for (std::size_t i = 0; i < moved.keyframes.size(); ++i) {
    const auto& before = one.second.keyframes[i];
    const geometry::SE2 error =
        moved.keyframes[i].map_T_vehicle.inverse() * (motion * before.map_T_vehicle);
    CHECK(error.Log().norm() < 1e-12);
    CHECK(moved.keyframes[i].keyframe_sequence == before.keyframe_sequence);
    if (before.covariance.isZero(0.0)) {
      CHECK(moved.keyframes[i].covariance.isZero(0.0));
    } else {
      CHECK(moved.keyframes[i].covariance.trace() > before.covariance.trace());
    }
  }
  CHECK((moved.submap_borders[0].corners_m[1] - motion * Eigen::Vector2d(1.0, 0.0)).norm() < 1e-12);
  CHECK((moved.loop_closures[0].to_m - motion * Eigen::Vector2d(12.0, 4.0)).norm() < 1e-12);
}

TEST_CASE("maps that are not aligned are not fused", "[map_merge]") {
  const Merge one({.width_m = 80.0}, 60);
  CHECK_THROWS_AS(map_merge::fuse(one.first, one.second, Alignment{}), std::invalid_argument);
  CHECK_THROWS_AS(map_merge::fuse(one.first, one.first, one.alignment), std::invalid_argument);
}
