// Range queries against brute force, registration against a known motion, and the quota.
#include <Eigen/LU>
#include <algorithm>
#include <random>
#include <utility>

#include "common/geometry/point_bins.hpp"
#include "common/geometry/registration.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geometry;

namespace {

std::vector<Eigen::Vector2d> scatter(std::size_t count, double half_side_m,
                                     std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-half_side_m, half_side_m);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(u(random), u(random));
  return points;
}

std::vector<UncertainPoint> uncertain(const std::vector<Eigen::Vector2d>& points, double sigma_m) {
  std::vector<UncertainPoint> result;
  for (const Eigen::Vector2d& point : points) result.push_back({point, sigma_m * sigma_m});
  return result;
}

/// The points as an observer at `reference_T_observed` measures them.
std::vector<UncertainPoint> observed_from(const SE2& reference_T_observed,
                                          const std::vector<Eigen::Vector2d>& points,
                                          double sigma_m, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector2d> moved;
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector2d noise(normal(random), normal(random));
    moved.push_back(reference_T_observed.inverse() * point + sigma_m * noise);
  }
  return uncertain(moved, sigma_m);
}

}  // namespace

TEST_CASE("Points in bins are found as brute force finds them", "[bins]") {
  std::mt19937_64 random(1);
  for (const double half_side_m : {5.0, 500.0}) {
    const auto points = scatter(200, half_side_m, random);
    const PointBins bins(points, 4.0);
    for (const Eigen::Vector2d& centre : scatter(50, 1.2 * half_side_m, random)) {
      const double radius_m = 0.2 * half_side_m;
      std::vector<std::uint32_t> found;
      bins.for_each_within(centre, radius_m, [&](std::uint32_t i, double d2) {
        REQUIRE(d2 == (points[i] - centre).squaredNorm());
        found.push_back(i);
      });
      std::sort(found.begin(), found.end());

      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        if ((points[i] - centre).norm() <= radius_m) expected.push_back(i);
      }
      REQUIRE(found == expected);
    }
  }
}

TEST_CASE("An empty set of bins finds nothing", "[bins]") {
  PointBins().for_each_within({0.0, 0.0}, 1e3, [](std::uint32_t, double) { FAIL(); });
}

TEST_CASE("Registration finds the motion and its covariance", "[registration]") {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  const double sigma_m = 0.05;
  double nees = 0.0;
  const int runs = 200;
  for (int run = 0; run < runs; ++run) {
    const auto reference = scatter(30, 25.0, random);
    const SE2 truth = SE2::Exp({0.3 * normal(random), 0.3 * normal(random), 0.03 * normal(random)});
    const auto observed = observed_from(truth, reference, sigma_m, random);
    const SE2WithCovariance guess{SE2(), Eigen::Vector3d(0.09, 0.09, 9e-4).asDiagonal()};
    const Registration found = register_points(uncertain(reference, 0.0), observed, guess);
    REQUIRE(found.pairs.size() > 25);
    for (const PointPair& pair : found.pairs) {
      if (!pair.ambiguous) REQUIRE(pair.reference == pair.observed);
    }
    const Eigen::Vector3d error = (found.reference_T_observed.inverse() * truth).Log();
    nees += error.dot(found.covariance.inverse() * error) / (3.0 * runs);
  }
  REQUIRE(nees == Approx(1.0).margin(0.2));
}

TEST_CASE("Once the pose is known, only points beside each other are ambiguous", "[registration]") {
  std::mt19937_64 random(4);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < 36; ++i) places.emplace_back(6.0 * (i % 6) - 15.0, 6.0 * (i / 6) - 15.0);
  std::vector<UncertainPoint> reference = uncertain(places, 0.02);
  const SE2 truth(0.4, -0.3, 0.05);
  const auto observed = observed_from(truth, places, 0.02, random);
  reference.push_back({places.front() + Eigen::Vector2d(0.1, 0.0), 4e-4});

  // At 21 m the guess is so uncertain that far points have to wait for near ones.
  const SE2WithCovariance guess{SE2(), Eigen::Vector3d(0.09, 0.09, 3e-3).asDiagonal()};
  const Registration found = register_points(reference, observed, guess);
  REQUIRE(found.pairs.size() == observed.size());
  REQUIRE((truth.inverse() * found.reference_T_observed).Log().norm() < 0.02);
  for (const PointPair& pair : found.pairs) REQUIRE(pair.ambiguous == (pair.observed == 0));
}

TEST_CASE("Without points the guess comes back", "[registration]") {
  const SE2WithCovariance guess{SE2(1.0, 2.0, 0.3), 0.1 * Eigen::Matrix3d::Identity()};
  const Registration found = register_points({}, {}, guess);
  REQUIRE(found.pairs.empty());
  REQUIRE(found.reference_T_observed.coordinates() == guess.mean.coordinates());
  REQUIRE(found.covariance == guess.covariance);
}

TEST_CASE("A rotation that no motion model predicts is searched", "[registration]") {
  std::mt19937_64 random(3);
  const auto reference = scatter(30, 25.0, random);
  const auto fits = [&](const Registration& tried) {
    return MatchQuota{4, 0.8}.is_met(tried.pairs.size(), reference.size());
  };
  for (const double rotation_rad : {-0.45, 0.0, 0.45}) {
    const SE2 truth(0.5, 0.1, rotation_rad);
    const auto observed = observed_from(truth, reference, 0.02, random);
    const Registration found = register_step(uncertain(reference, 0.02), observed, SE2(),
                                             SE2(0.5, 0.0, 0.0), {}, {}, fits);
    REQUIRE(fits(found));
    REQUIRE((truth.inverse() * found.reference_T_observed).Log().norm() < 0.02);
  }
}

TEST_CASE("A quota asks for a number and for a share", "[registration]") {
  const MatchQuota quota{4, 0.5};
  CHECK(quota.is_met(4, 8));
  CHECK_FALSE(quota.is_met(4, 9));
  CHECK_FALSE(quota.is_met(3, 4));
  CHECK(quota.share_is_met(3, 4));
  CHECK(quota.share_is_met(0, 0));
  CHECK_FALSE(quota.is_met(0, 0));

  // With three points in view, three are enough.
  CHECK(quota.capped_at(3).is_met(3, 4));
  CHECK_FALSE(quota.capped_at(3).is_met(2, 4));
  CHECK(quota.capped_at(9).min_matched == 4);
}
