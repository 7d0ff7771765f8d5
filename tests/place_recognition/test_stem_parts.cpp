// Packed stems, triangles, hypotheses, likelihood and chains, each against what must hold of it.
#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <set>

#include "common/place_recognition/hypotheses.hpp"
#include "common/place_recognition/stem_chains.hpp"
#include "common/place_recognition/stem_likelihood.hpp"
#include "common/place_recognition/stem_triangles.hpp"
#include "tests/catch.hpp"
#include "tests/place_recognition/stem_scene.hpp"

using namespace understory;
using namespace understory::place_recognition;

namespace {

using Corners = std::set<std::uint16_t>;

/// All triples with sides up to a length that are high enough, by trying all.
std::set<Corners> all_triples(const std::vector<LevelStem>& stems, double longest_m,
                              double least_height_m) {
  std::set<Corners> found;
  for (std::size_t i = 0; i < stems.size(); ++i) {
    for (std::size_t j = i + 1; j < stems.size(); ++j) {
      for (std::size_t k = j + 1; k < stems.size(); ++k) {
        const Eigen::Vector2d u = stems[j].position_m - stems[i].position_m;
        const Eigen::Vector2d v = stems[k].position_m - stems[i].position_m;
        const double longest = std::max({u.norm(), v.norm(), (u - v).norm()});
        const double height = std::abs(u.x() * v.y() - u.y() * v.x()) / longest;
        if (longest <= longest_m && height >= least_height_m)
          found.insert({static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j),
                        static_cast<std::uint16_t>(k)});
      }
    }
  }
  return found;
}

double longest_side(const std::vector<StemTriangle>& triangles) {
  double longest = 0.0;
  for (const StemTriangle& triangle : triangles)
    longest = std::max<double>(longest, triangle.side_m[0]);
  return longest;
}

}  // namespace

TEST_CASE("Packed stems come back to 5 mm, what cannot be kept is left out", "[stems]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const PackedStems packed(std::vector<LevelStem>{{{1.2344, -55.4321}, 0.3127},
                                                  {{nan, 1.0}, 0.2},
                                                  {{1.0, nan}, 0.2},
                                                  {{161.0, 0.0}, 0.2},
                                                  {{-160.0, 160.0}, nan},
                                                  {{0.0, 1e300}, 0.2}});
  const auto stems = packed.unpacked();
  REQUIRE(stems.size() == 2);
  CHECK((stems[0].position_m - Eigen::Vector2d(1.2344, -55.4321)).cwiseAbs().maxCoeff() <= 0.0025);
  CHECK(std::abs(stems[0].diameter_m - 0.3127) <= 0.0005);
  CHECK(stems[1].position_m == Eigen::Vector2d(-160.0, 160.0));
  CHECK(stems[1].diameter_m == 0.0);
  CHECK(packed.bytes() == 12);
}

TEST_CASE("Triangles are all triples with sides up to a length, in canonical order", "[stems]") {
  std::mt19937_64 random(1);
  test::StemScene scene(random, 60.0);
  for (int i = 0; i < 20; ++i) {
    const auto stems = scene.frame({30.0, 30.0, 0.3 * i}, {});
    const auto triangles = stem_triangles(stems, {});
    std::set<Corners> found;
    for (const StemTriangle& triangle : triangles) {
      CHECK(triangle.side_m[0] >= triangle.side_m[1]);
      CHECK(triangle.side_m[1] >= triangle.side_m[2]);
      found.insert({triangle.corner[0], triangle.corner[1], triangle.corner[2]});
    }
    CHECK(found.size() == triangles.size());
    const auto expected =
        all_triples(stems, longest_side(triangles) + 1e-5, StemTriangleParameters{}.least_height_m);
    CHECK((found == expected));
    CHECK(triangles.size() > 100);
    CHECK(triangles.size() < 1800);
  }
}

TEST_CASE("Fewer than three stems have no triangle", "[stems]") {
  CHECK(stem_triangles({}, {}).empty());
  CHECK(stem_triangles(std::vector<LevelStem>{{{1, 2}, 0}, {{3, 4}, 0}}, {}).empty());
  CHECK(stem_triangles(std::vector<LevelStem>(5), {}).empty());
}

TEST_CASE("The true pose is among the hypotheses of two frames of one place", "[stems]") {
  std::mt19937_64 random(2);
  test::StemScene scene(random, 80.0);
  for (int i = 0; i < 20; ++i) {
    const geometry::SE2 here(40.0, 40.0, 0.1 * i);
    const geometry::SE2 there = here * geometry::SE2(3.0, -2.0, 2.0);
    const auto a = scene.frame(here, {});
    const auto b = scene.frame(there, {});
    TripletIndex index(0.25);
    index.add(a, stem_triangles(a, {}));
    std::vector<PlaceCluster> clusters;
    collect_clusters(index.hypotheses(b, stem_triangles(b, {}), {}), clusters);
    REQUIRE_FALSE(clusters.empty());
    const Eigen::Vector3d off =
        (clusters[0].frame_T_query.inverse() * here.inverse() * there).Log();
    CHECK(off.head<2>().norm() < 0.5);
    CHECK(std::abs(off.z()) < 0.05);
    CHECK(clusters[0].votes >= 5);
  }
}

TEST_CASE("The refined pose is the true one within what its covariance states", "[stems]") {
  std::mt19937_64 random(3);
  test::StemScene scene(random, 100.0);
  StemNoise noise;
  noise.sigma_m = 0.05 * std::sqrt(2.0);
  noise.wide_share = 0.02;
  double nees = 0.0;
  const int runs = 300;
  for (int i = 0; i < runs; ++i) {
    const geometry::SE2 here(35.0 + 0.1 * i, 50.0, 0.1 * i);
    const geometry::SE2 here_T_there(1.0, 2.0, 0.5);
    test::StemErrors errors;
    errors.sigma_m = 0.05;
    errors.seen_share = 0.85;
    const auto query = scene.frame(here * here_T_there, errors);
    const StemLikelihood frame(view_of(scene.frame(here, errors)), noise, {});
    const geometry::SE2 start = here_T_there * geometry::SE2(0.2, -0.15, 0.01);
    const geometry::SE2 pose = frame.refined(query, start);
    CHECK(frame.log_ratio(query, pose) > frame.log_ratio(query, start));

    const auto pairs = frame.pairs(query, pose, 0.4);
    REQUIRE(pairs.size() > 5);
    const Eigen::Vector3d error = (pose.inverse() * here_T_there).Log();
    CHECK(error.head<2>().norm() < 0.15);
    nees += error.dot(frame.covariance(query, pose, pairs).ldlt().solve(error)) / runs;
  }
  // Mean of 300 chi-squared with 3 degrees of freedom: 3 +- 0.14; stated a little too large where
  // the pairs show less than the noise, never too small.
  CHECK(nees > 1.8);
  CHECK(nees < 3.5);
}

TEST_CASE("Diameters speak for the right stems and against wrong ones", "[stems]") {
  std::mt19937_64 random(4);
  test::StemScene scene(random, 60.0);
  const auto frame = scene.frame({30.0, 30.0, 0.0}, {});
  StemNoise noise;
  const StemLikelihood with(view_of(frame), noise, {});
  noise.use_diameters = false;
  const StemLikelihood without(view_of(frame), noise, {});
  auto swapped = frame;
  for (std::size_t i = 0; i < swapped.size(); ++i)
    swapped[i].diameter_m = frame[(i + 1) % frame.size()].diameter_m;
  auto unknown = frame;
  for (LevelStem& stem : unknown) stem.diameter_m = 0.0;

  CHECK(with.log_ratio(frame, {}) > without.log_ratio(frame, {}) + 5.0);
  CHECK(with.log_ratio(swapped, {}) < with.log_ratio(frame, {}) - 5.0);
  CHECK(without.log_ratio(swapped, {}) == without.log_ratio(frame, {}));
  CHECK(with.log_ratio(unknown, {}) == without.log_ratio(unknown, {}));
}

TEST_CASE("Frames of a drive chain themselves, and a view holds what one frame missed", "[stems]") {
  std::mt19937_64 random(5);
  test::StemScene scene(random, 120.0);
  const test::StemErrors errors{.seen_share = 0.8};
  StemChains chains({}, {}, {});
  DiameterStatistics diameters;
  std::vector<geometry::SE2> poses;
  for (int i = 0; i < 30; ++i) {
    poses.emplace_back(25.0 + 2.0 * i, 60.0 + 5.0 * std::sin(0.3 * i), 0.2 * i);
    chains.add(PackedStems(scene.frame(poses.back(), errors)), diameters.spread());
  }

  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t k = i; k < std::min(poses.size(), i + 17); ++k) {
      const auto known = chains.between(i, k);
      REQUIRE(known);
      CHECK((known->inverse() * poses[i].inverse() * poses[k]).translation().norm() < 0.15);
    }
    const StemView view = chains.view(i, poses.size());
    CHECK(view.stems.size() == view.weight.size());
    CHECK(view.stems.size() > 1.15 * static_cast<double>(chains.stems(i).size()));
    for (const LevelStem& stem : view.stems) {
      const Eigen::Vector2d at = poses[i] * stem.position_m;
      CHECK(std::ranges::any_of(scene.stems(), [&](const LevelStem& real) {
        return (real.position_m - at).norm() < 0.35;
      }));
    }
  }
  CHECK_FALSE(chains.between(0, 17));
  CHECK(chains.view(10, 11).stems.size() < chains.view(10, 30).stems.size());
}

TEST_CASE("A frame of another place begins a new chain", "[stems]") {
  std::mt19937_64 random(6);
  test::StemScene scene(random, 200.0);
  StemChains chains({}, {}, {});
  for (const double x : {30.0, 32.0, 160.0, 162.0})
    chains.add(PackedStems(scene.frame({x, 100.0, 0.0}, {})), {});
  CHECK(chains.between(0, 1));
  CHECK_FALSE(chains.between(1, 2));
  CHECK(chains.between(2, 3));
  CHECK(chains.view(2, 4).stems.size() >= chains.stems(2).size());
}

TEST_CASE("Pairs of stems are the mutually nearest of all", "[stems]") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-15.0, 15.0);
  const auto stems = [&](std::size_t n) {
    std::vector<LevelStem> made(n);
    for (LevelStem& stem : made) stem.position_m = {place(random), place(random)};
    return made;
  };
  const auto nearest_in = [](const std::vector<LevelStem>& all, const Eigen::Vector2d& point_m) {
    return std::ranges::min_element(
               all, {},
               [&](const LevelStem& stem) { return (stem.position_m - point_m).squaredNorm(); }) -
           all.begin();
  };

  for (int run = 0; run < 50; ++run) {
    const auto frame = stems(80);
    const auto query = stems(60);
    const geometry::SE2 pose(0.1 * run, 1.0, 0.2 * run);
    auto mapped = query;
    for (LevelStem& stem : mapped) stem.position_m = pose * stem.position_m;
    const double gate_m = 1.5;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> expected;
    for (std::uint32_t i = 0; i < query.size(); ++i) {
      const auto j = static_cast<std::uint32_t>(nearest_in(frame, mapped[i].position_m));
      const bool is_mutual = nearest_in(mapped, frame[j].position_m) == i;
      if (is_mutual && (frame[j].position_m - mapped[i].position_m).norm() < gate_m)
        expected.emplace_back(i, j);
    }

    std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
    for (const StemPair& pair : StemLikelihood(view_of(frame), {}, {}).pairs(query, pose, gate_m))
      found.emplace_back(pair.query, pair.frame);
    CHECK(found == expected);
  }
}
