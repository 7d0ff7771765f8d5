// Finding the place of an observation, and never a wrong one.
#include <Eigen/Cholesky>
#include <algorithm>
#include <numbers>
#include <random>

#include "common/constellation/chance.hpp"
#include "common/constellation/map.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::constellation;

namespace {

using Points = std::vector<Eigen::Vector2d>;

/// Points with a least distance, as trees keep it.
Points random_scene(std::mt19937_64& random, double side_m, double per_m2, double apart_m) {
  std::uniform_real_distribution<double> place(0.0, side_m);
  Points points;
  const auto wanted = static_cast<std::size_t>(per_m2 * side_m * side_m);
  while (points.size() < wanted) {
    const Eigen::Vector2d point(place(random), place(random));
    const bool crowded = std::any_of(points.begin(), points.end(), [&](const auto& other) {
      return (other - point).squaredNorm() < apart_m * apart_m;
    });
    if (!crowded) points.push_back(point);
  }
  return points;
}

ConstellationMap map_of(const Points& points, const geometry::SE2& map_T_scene = {}) {
  ConstellationMap map;
  for (std::size_t i = 0; i < points.size(); ++i) map.insert(i + 1, map_T_scene * points[i]);
  return map;
}

struct View {
  double range_m = 40.0;
  double sigma_m = 0.1;
  double detection = 0.9;
  double clutter = 0.0;  ///< False points per true one.
};

struct Observation {
  std::vector<ObservedPoint> points;
  std::vector<LandmarkId> truth;  ///< 0 = false point.
};

Observation observe(const Points& scene, const geometry::SE2& scene_T_sensor, const View& view,
                    std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, view.sigma_m);
  std::vector<std::pair<ObservedPoint, LandmarkId>> seen;

  for (std::size_t i = 0; i < scene.size(); ++i) {
    const Eigen::Vector2d point = scene_T_sensor.inverse() * scene[i];
    if (point.norm() > view.range_m || unit(random) > view.detection) continue;
    seen.push_back({{point + Eigen::Vector2d(noise(random), noise(random)), view.sigma_m}, i + 1});
  }

  const auto clutter = static_cast<int>(view.clutter * static_cast<double>(seen.size()));
  for (int i = 0; i < clutter; ++i) {
    const double radius = view.range_m * std::sqrt(unit(random));
    const double angle = 2.0 * std::numbers::pi * unit(random);
    seen.push_back(
        {{{radius * std::cos(angle), radius * std::sin(angle)}, view.sigma_m}, LandmarkId{0}});
  }

  std::shuffle(seen.begin(), seen.end(), random);
  Observation observation;
  for (const auto& [point, id] : seen) {
    observation.points.push_back(point);
    observation.truth.push_back(id);
  }

  return observation;
}

geometry::SE2 random_pose(std::mt19937_64& random, double low_m, double high_m) {
  std::uniform_real_distribution<double> place(low_m, high_m);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  const double x = place(random);
  const double y = place(random);
  return {x, y, angle(random)};
}

double distance(const geometry::SE2& a, const geometry::SE2& b) {
  return (a.translation() - b.translation()).norm();
}

}  // namespace

TEST_CASE("An observation finds its place, its landmarks and its covariance", "[constellation]") {
  std::mt19937_64 random(1);
  const Points scene = random_scene(random, 400.0, 0.0138, 2.0);
  const ConstellationMap map = map_of(scene);
  const std::vector<View> views{
      {40, 0.1, 0.9, 0.0}, {40, 0.2, 0.8, 0.0}, {40, 0.1, 0.6, 1.0}, {25, 0.05, 1.0, 0.0}};
  LocaliseParameters parameters;
  parameters.map_sigma_m = 0.001;  // the map is exact here

  for (const View& view : views) {
    double nees = 0.0;
    int wrong_pairs = 0;
    int pairs = 0;
    const int n = 300;

    for (int i = 0; i < n; ++i) {
      const geometry::SE2 truth = random_pose(random, 50, 350);
      const Observation observation = observe(scene, truth, view, random);
      const Localisation result = map.localise(observation.points, parameters);
      REQUIRE(result.found());
      REQUIRE(distance(result.map_T_sensor, truth) < 0.25);
      REQUIRE(result.inliers == result.associations.size());
      std::vector<LandmarkId> ids;

      for (const PointAssociation& association : result.associations) {
        ids.push_back(association.landmark_id);
        wrong_pairs += observation.truth[association.observed] != association.landmark_id ? 1 : 0;
        ++pairs;
      }

      std::sort(ids.begin(), ids.end());
      REQUIRE(std::adjacent_find(ids.begin(), ids.end()) == ids.end());
      const Eigen::Vector3d error = (result.map_T_sensor.inverse() * truth).Log();
      nees += error.dot(result.covariance.ldlt().solve(error)) / n;
    }

    REQUIRE(wrong_pairs < 0.008 * pairs);

    // 3 degrees of freedom, 300 runs: 2.6 to 3.4 is four sigmas; false pairs add a little.
    REQUIRE(nees > 2.4);
    REQUIRE(nees < 4.2);
  }
}

TEST_CASE("The answer moves with the map and with the observation", "[constellation]") {
  std::mt19937_64 random(2);
  const Points scene = random_scene(random, 300.0, 0.0138, 2.0);
  const ConstellationMap map = map_of(scene);

  for (int i = 0; i < 40; ++i) {
    const geometry::SE2 moved_T_scene = random_pose(random, -1000, 1000);
    const geometry::SE2 turned_T_sensor = random_pose(random, -5, 5);
    const ConstellationMap moved = map_of(scene, moved_T_scene);
    Observation observation = observe(scene, random_pose(random, 50, 250), {}, random);
    const Localisation first = map.localise(observation.points);

    for (ObservedPoint& point : observation.points) {
      point.position_m = turned_T_sensor * point.position_m;
    }

    const Localisation second = moved.localise(observation.points);
    REQUIRE(first.found());
    REQUIRE(second.found());
    const geometry::SE2 expected = moved_T_scene * first.map_T_sensor * turned_T_sensor.inverse();
    REQUIRE((expected.inverse() * second.map_T_sensor).Log().norm() < 1e-6);
    REQUIRE(first.inliers == second.inliers);
  }
}

TEST_CASE("Scenes that are not in the map are not found", "[constellation]") {
  std::mt19937_64 random(3);
  const Points scene = random_scene(random, 500.0, 0.0138, 2.0);
  const Points other = random_scene(random, 500.0, 0.0138, 2.0);
  const ConstellationMap map = map_of(scene);

  for (const double sigma_m : {0.05, 0.2}) {
    for (int i = 0; i < 120; ++i) {
      View view;
      view.sigma_m = sigma_m;
      view.range_m = 15.0 + 25.0 / 120.0 * i;
      const geometry::SE2 pose = random_pose(random, 50, 450);
      REQUIRE_FALSE(map.localise(observe(other, pose, view, random).points).found());
      Observation mirrored = observe(scene, pose, view, random);
      for (ObservedPoint& point : mirrored.points) point.position_m.y() *= -1.0;
      REQUIRE_FALSE(map.localise(mirrored.points).found());
    }
  }
}

TEST_CASE("Doubled landmarks of another scene are not found", "[constellation]") {
  // A bad keyframe holds landmarks twice, next to each other: small triangles that fit anywhere.
  std::mt19937_64 random(9);
  const Points scene = random_scene(random, 200.0, 0.042, 0.5);
  const Points other = random_scene(random, 200.0, 0.042, 0.5);
  const ConstellationMap map = map_of(scene);
  std::normal_distribution<double> apart(0.0, 0.3);

  for (int i = 0; i < 40; ++i) {
    View view;
    view.sigma_m = 0.05;
    Observation observation = observe(other, random_pose(random, 40, 160), view, random);
    const std::size_t n = observation.points.size();
    for (std::size_t k = 0; k < n; ++k) {
      ObservedPoint twin = observation.points[k];
      twin.position_m += Eigen::Vector2d(apart(random), apart(random));
      observation.points.push_back(twin);
    }
    REQUIRE_FALSE(map.localise(observation.points).found());
  }
}

TEST_CASE("A scene that is in the map twice is ambiguous", "[constellation]") {
  std::mt19937_64 random(4);
  const Points scene = random_scene(random, 120.0, 0.0138, 2.0);
  ConstellationMap map = map_of(scene);
  const geometry::SE2 map_T_copy(400.0, -300.0, 2.0);
  for (std::size_t i = 0; i < scene.size(); ++i) map.insert(10000 + i, map_T_copy * scene[i]);

  for (int i = 0; i < 100; ++i) {
    const Observation observation = observe(scene, random_pose(random, 45, 75), {}, random);
    const Localisation result = map.localise(observation.points);
    REQUIRE(result.outcome == LocaliseOutcome::kAmbiguous);
    REQUIRE(result.runner_up_inliers + 4 >= result.inliers);
    // Told which of the two it can be, it is sure.
    const Disc where{map_T_copy * Eigen::Vector2d(60, 60), 40.0};
    const Localisation told = map.localise(observation.points, {}, where);
    REQUIRE(told.found());
    REQUIRE((told.map_T_sensor.translation() - where.centre_m).norm() < where.radius_m);
  }
}

TEST_CASE("Rows of a plantation are never mistaken for a place", "[constellation]") {
  std::mt19937_64 random(5);
  std::normal_distribution<double> jitter(0.0, 0.05);
  Points scene;

  for (int i = 0; i < 50; ++i) {
    for (int j = 0; j < 50; ++j)
      scene.emplace_back(5.0 * i + jitter(random), 4.0 * j + jitter(random));
  }

  const ConstellationMap map = map_of(scene);
  for (int i = 0; i < 60; ++i) {
    const geometry::SE2 truth = random_pose(random, 60, 140);
    const Observation observation = observe(scene, truth, {}, random);
    const Localisation result = map.localise(observation.points);
    REQUIRE((!result.found() || distance(result.map_T_sensor, truth) < 0.5));
  }
}

TEST_CASE("A scene of which a part is mapped is found by that part", "[constellation]") {
  std::mt19937_64 random(6);
  const Points scene = random_scene(random, 300.0, 0.0138, 2.0);
  ConstellationMap half;

  for (std::size_t i = 0; i < scene.size(); ++i) {
    if (scene[i].x() < 150.0) half.insert(i + 1, scene[i]);
  }

  int found = 0;
  for (int i = 0; i < 200; ++i) {
    // 5 to 20 m outside the mapped half: a half down to a fifth of the view is mapped.
    const geometry::SE2 truth(155.0 + 0.075 * i, random_pose(random, 60, 240).y(), 0.03 * i);
    const Localisation result = half.localise(observe(scene, truth, {}, random).points);
    if (!result.found()) continue;
    ++found;
    REQUIRE(distance(result.map_T_sensor, truth) < 0.5);
  }

  REQUIRE(found >= 196);
}

TEST_CASE("In a crowd the test of a hypothesis forgives misses as chance explains hits",
          "[constellation]") {
  // Gates that hold a landmark by chance now and then; a third to half of the points is true.
  const std::vector<View> views{{30, 0.3, 0.6, 0.5}, {40, 0.2, 0.4, 1.5}};
  int found = 0;
  for (const View& view : views) {
    std::mt19937_64 random(26);
    const Points scene = random_scene(random, 300.0, 0.06, 1.5);
    const ConstellationMap map = map_of(scene);
    for (int i = 0; i < 100; ++i) {
      const geometry::SE2 truth = random_pose(random, 50, 250);
      const Localisation result = map.localise(observe(scene, truth, view, random).points);
      if (!result.found()) continue;
      REQUIRE(distance(result.map_T_sensor, truth) < 0.5);
      ++found;
    }
  }
  // About 110; with misses that count too much 63.
  REQUIRE(found >= 85);
}

TEST_CASE("However uncertain, no point belongs to a landmark 1.5 m away", "[constellation]") {
  std::mt19937_64 random(9);
  const Points scene = random_scene(random, 200.0, 0.0138, 6.0);
  const ConstellationMap map = map_of(scene);
  int near_pairs = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const geometry::SE2 truth = random_pose(random, 60, 140);
    Observation observation = observe(scene, truth, {40, 0.05, 1.0, 0.0}, random);
    // Two vague points, one nearer to its landmark than that, one farther.
    for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
      ObservedPoint& point = observation.points[k];
      point.position_m += Eigen::Vector2d(k == 0 ? 1.2 : 1.8, 0.0);
      point.sigma_m = 2.0;
    }
    const Localisation result = map.localise(observation.points);
    REQUIRE(result.found());
    for (const PointAssociation& pair : result.associations) {
      REQUIRE(pair.observed != 1);
      REQUIRE(pair.distance_m <= 1.5);
      near_pairs += pair.observed == 0 ? 1 : 0;
    }
  }
  CHECK(near_pairs == 20);
}

TEST_CASE("The same question gets the same answer", "[constellation]") {
  std::mt19937_64 random(7);
  const Points scene = random_scene(random, 300.0, 0.0138, 2.0);
  const ConstellationMap map = map_of(scene);
  ConstellationMap backwards;
  for (std::size_t i = scene.size(); i > 0; --i) backwards.insert(i, scene[i - 1]);

  for (int i = 0; i < 100; ++i) {
    const Observation observation = observe(scene, random_pose(random, 50, 250), {}, random);
    const Localisation first = map.localise(observation.points);
    const Localisation second = map.localise(observation.points);
    REQUIRE(first.map_T_sensor.coordinates() == second.map_T_sensor.coordinates());
    REQUIRE(first.covariance == second.covariance);
    REQUIRE(first.hypotheses == second.hypotheses);
    // Nor does it matter how the map came about.
    const Localisation third = backwards.localise(observation.points);
    REQUIRE(first.map_T_sensor.coordinates() == third.map_T_sensor.coordinates());
    REQUIRE(first.inliers == third.inliers);
  }
}

TEST_CASE("Too small and unusable observations are reported as such", "[constellation]") {
  std::mt19937_64 random(8);
  const Points scene = random_scene(random, 100.0, 0.0138, 2.0);
  const ConstellationMap map = map_of(scene);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<ObservedPoint> points;
  REQUIRE(map.localise(points).outcome == LocaliseOutcome::kTooFewPoints);
  points = {{{1, 2}, 0.1}, {{3, nan}, 0.1}, {{5, 9}, nan}, {{1e9, 0}, 0.1}, {{4, 4}, 0.1}};

  REQUIRE(map.localise(points).outcome == LocaliseOutcome::kTooFewPoints);
  REQUIRE(ConstellationMap().localise(points).outcome == LocaliseOutcome::kTooFewPoints);

  // Three points fit somewhere in any forest, and one place is no news.
  points = {{scene[0], 0.1}, {scene[1], 0.1}, {scene[2], 0.1}};
  REQUIRE_FALSE(map.localise(points).found());

  // One point many times over, and all in a line.
  points.assign(50, {{1, 2}, 0.1});
  REQUIRE_FALSE(map.localise(points).found());
  for (std::size_t i = 0; i < points.size(); ++i) points[i].position_m.x() = 3.0 * i;
  REQUIRE_FALSE(map.localise(points).found());
}

TEST_CASE("The bound on the binomial tail bounds it", "[constellation]") {
  for (const int n : {5, 40, 150}) {
    for (const double p : {0.002, 0.05, 0.4}) {
      long double tail = 0.0;
      long double term = std::pow(static_cast<long double>(p), n);  // P(X = n), then downwards
      for (int k = n; k > 0; --k) {
        tail += term;
        const double bound = log10_binomial_tail_bound(k, n, p);
        REQUIRE(bound >= static_cast<double>(std::log10(tail)) - 1e-9);
        if (k > 2 * n * p + 2)
          REQUIRE(bound < static_cast<double>(std::log10(tail)) + 2.0);  // and not by far
        term *= k / (n - k + 1.0) * (1.0 - p) / p;
      }
    }
  }
}
