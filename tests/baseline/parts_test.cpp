#include <algorithm>
#include <set>

#include "eval/baselines/keyframer/clusters.hpp"
#include "eval/baselines/mapper/discovery.hpp"
#include "eval/baselines/mapper/pose.hpp"
#include "tests/baseline/clouds.hpp"
#include "tests/catch.hpp"

namespace understory::test {
namespace {

using test::moved;
using test::random_cloud;

/// Sets of points that a chain of steps <= tolerance joins, by spreading labels.
std::set<std::vector<std::uint32_t>> chained(const std::vector<Eigen::Vector2d>& cloud,
                                             double tolerance_m) {
  std::vector<std::uint32_t> label(cloud.size());
  for (std::uint32_t i = 0; i < label.size(); ++i) {
    label[i] = i;
  }

  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      for (std::size_t j = 0; j < cloud.size(); ++j) {
        if (label[j] < label[i] && (cloud[i] - cloud[j]).norm() <= tolerance_m) {
          label[i] = label[j];
          changed = true;
        }
      }
    }
  }

  std::set<std::vector<std::uint32_t>> clusters;

  for (std::uint32_t root = 0; root < label.size(); ++root) {
    std::vector<std::uint32_t> cluster;
    for (std::uint32_t i = 0; i < label.size(); ++i) {
      if (label[i] == root) {
        cluster.push_back(i);
      }
    }
    if (cluster.size() >= 2 && cluster.size() <= 8) {
      clusters.insert(cluster);
    }
  }
  return clusters;
}

TEST_CASE("Clusters are chains of near points, of the sizes asked for, largest first") {
  std::mt19937_64 random(1);
  for (int round = 0; round < 30; ++round) {
    const auto cloud = test::random_cloud(150, 18.0, random);
    const auto clusters = eval::baselines::keyframer::single_linkage(cloud, 1.0, 2, 8);
    CHECK(std::set<std::vector<std::uint32_t>>(clusters.begin(), clusters.end()) ==
          chained(cloud, 1.0));
    CHECK(std::is_sorted(clusters.begin(), clusters.end(),
                         [](const auto& a, const auto& b) { return a.size() > b.size(); }));
  }
}

eval::baselines::mapper::Observation observation(double x, double y) {
  eval::baselines::mapper::Observation s;
  s.in_map_m = {x, y};
  s.in_pose_m = {x - 1.0, y};
  s.observation_count = 8;
  return s;
}

TEST_CASE("The fourth observation near three others makes a landmark, at their mean") {
  eval::baselines::mapper::DiscoveryNetwork network;
  const eval::baselines::mapper::DiscoveryParameters parameters;
  for (std::uint32_t pose = 0; pose < 3; ++pose) {
    CHECK(network.add(pose, {observation(10.0 + 0.1 * pose, 5.0)}, parameters).empty());
    network.slide(parameters);
  }
  const auto found = network.add(3, {observation(30.0, 5.0), observation(10.3, 5.0)}, parameters);
  REQUIRE(found.size() == 1);
  CHECK(found[0].position_m.x() == Approx(10.15));
  CHECK(found[0].observations.size() == 4);
  CHECK(network.nodes().size() == 1);  // The one at 30 m stays.
}

TEST_CASE("Observations older than the window do not count") {
  eval::baselines::mapper::DiscoveryNetwork network;
  const eval::baselines::mapper::DiscoveryParameters parameters;
  for (std::uint32_t pose = 0; pose < 8; ++pose) {
    const bool is_observed = pose % 2 == 0;  // Three within any five poses.
    std::vector<eval::baselines::mapper::Observation> observations;
    if (is_observed) {
      observations.push_back(observation(10.0, 5.0));
    }
    CHECK(network.add(pose, observations, parameters).empty());
    network.slide(parameters);
    CHECK(network.poses().size() < 5);
  }
}

TEST_CASE("A chain of observations is no landmark") {
  eval::baselines::mapper::DiscoveryNetwork network;
  const eval::baselines::mapper::DiscoveryParameters parameters;
  for (std::uint32_t pose = 0; pose < 5; ++pose) {
    CHECK(network.add(pose, {observation(10.0 + 0.4 * pose, 5.0)}, parameters).empty());
  }
}

TEST_CASE("A pose is found among wrong associations") {
  std::mt19937_64 random(2);
  const auto map = test::random_cloud(120, 60.0, random);
  const geometry::SE2 map_T_base(31.0, 28.0, 2.1);
  std::vector<Eigen::Vector2d> local;

  for (std::size_t i = 0; i < 40; ++i) {
    local.push_back(map_T_base.inverse() * map[i]);
  }

  std::vector<eval::baselines::hierarchy::PointMatch> matches;

  for (std::uint32_t i = 0; i < 20; ++i) {
    matches.push_back({i, i % 3 == 0 ? 100 - i : i});
  }

  std::mt19937 samples(10);
  const auto estimate = eval::baselines::mapper::estimate_pose(local, map, matches, {}, samples);
  REQUIRE(estimate);
  CHECK((map_T_base.inverse() * estimate->map_T_base.pose()).Log().norm() < 1e-6);
  CHECK(estimate->associations.size() == 40);
  CHECK(std::all_of(
      estimate->associations.begin(), estimate->associations.end(),
      [](const eval::baselines::hierarchy::PointMatch& pair) { return pair.local == pair.other; }));
}

TEST_CASE("A map landmark that two claim is given to neither") {
  const std::vector<Eigen::Vector2d> map{{0, 0},  {10, 0}, {0, 10}, {10, 10},
                                         {5, 17}, {-8, 3}, {20, 3}};
  std::vector<Eigen::Vector2d> local = map;
  local.emplace_back(20.1, 3.0);
  const std::vector<eval::baselines::hierarchy::PointMatch> matches{{0, 0}, {1, 1}, {2, 2}, {3, 3}};
  std::mt19937 samples(10);
  const auto estimate = eval::baselines::mapper::estimate_pose(local, map, matches, {}, samples);
  REQUIRE(estimate);
  CHECK(estimate->associations.size() == 6);
  CHECK(estimate->unmatched.size() == 2);
}

TEST_CASE("Too few associations give no pose") {
  std::mt19937_64 random(3);
  const auto map = test::random_cloud(50, 60.0, random);
  const std::vector<Eigen::Vector2d> local(map.begin(), map.begin() + 5);
  const std::vector<eval::baselines::hierarchy::PointMatch> matches{{0, 0}, {1, 1}, {2, 2}};
  std::mt19937 samples(10);
  CHECK_FALSE(eval::baselines::mapper::estimate_pose(local, map, matches, {}, samples));
}

TEST_CASE("As many associations as a sample has give a pose") {
  std::mt19937_64 random(4);
  const geometry::SE2 map_T_base(30.0, 30.0, 0.4);
  const auto map = test::random_cloud(50, 60.0, random);
  std::vector<Eigen::Vector2d> local;
  for (std::size_t i = 0; i < 12; ++i) local.push_back(map_T_base.inverse() * map[i]);
  const eval::baselines::mapper::Parameters parameters;
  std::vector<eval::baselines::hierarchy::PointMatch> matches;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(parameters.pose_sample_size); ++i) {
    matches.push_back({i, i});
  }
  std::mt19937 samples(10);
  const auto estimate =
      eval::baselines::mapper::estimate_pose(local, map, matches, parameters, samples);
  REQUIRE(estimate);
  CHECK((map_T_base.inverse() * estimate->map_T_base.pose()).Log().norm() < 1e-6);
}

}  // namespace
}  // namespace understory::test
