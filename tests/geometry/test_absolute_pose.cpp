#include <Eigen/LU>
#include <cmath>
#include <random>

#include "common/geometry/absolute_pose.hpp"
#include "tests/catch.hpp"

using namespace understory::geometry;

namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Eigen::Vector3d normal3(Random& random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(random), y = normal(random);
  return {x, y, normal(random)};
}

Eigen::Isometry3d random_pose(Random& random) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d axis = normal3(random, 1.0).normalized();
  pose.linear() = Eigen::AngleAxisd(uniform(random, -3.1, 3.1), axis).toRotationMatrix();
  pose.translation() = normal3(random, 10.0);
  return pose;
}

/// A point in a camera's field of view.
PointSighting sighting(const Eigen::Isometry3d& camera_T_map, Random& random,
                       double sigma_rad = 0.0) {
  const double depth = uniform(random, 1.0, 15.0);
  const Eigen::Vector3d at(depth * uniform(random, -0.8, 0.8), depth * uniform(random, -0.6, 0.6),
                           depth);
  PointSighting pair;
  pair.point_m = camera_T_map.inverse() * at;
  const Eigen::Vector3d noise = normal3(random, sigma_rad);
  pair.bearing = (at.normalized() + noise - noise.dot(at.normalized()) * at.normalized());
  pair.bearing.normalize();
  return pair;
}

double rotation_error(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}
/// Of the camera's place in the map.
double place_error(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.inverse().translation() - b.inverse().translation()).norm();
}

std::vector<PointSighting> pairs_with_outliers(const Eigen::Isometry3d& truth, int good, int bad,
                                               double sigma_rad, Random& random) {
  std::vector<PointSighting> pairs;
  for (int i = 0; i < good; ++i) pairs.push_back(sighting(truth, random, sigma_rad));
  for (int i = 0; i < bad; ++i) {
    PointSighting wrong = sighting(truth, random);
    wrong.point_m = sighting(truth, random).point_m;
    pairs.push_back(wrong);
  }
  return pairs;
}

}  // namespace

TEST_CASE("three points give the true pose among their solutions") {
  Random random(1);
  int missed = 0;
  double worst = 0.0;
  for (int trial = 0; trial < 20'000; ++trial) {
    const Eigen::Isometry3d truth = random_pose(random);
    const std::array<PointSighting, 3> three{sighting(truth, random), sighting(truth, random),
                                             sighting(truth, random)};
    const auto poses = solve_three_points(three);
    REQUIRE(poses.size() <= 4);

    double best = 1e9;
    for (const Eigen::Isometry3d& pose : poses) {
      best = std::min(best, place_error(pose, truth) + rotation_error(pose, truth));
      // Every solution sees the points as stated, the true one or not.
      for (const PointSighting& pair : three)
        REQUIRE((pose * pair.point_m).normalized().dot(pair.bearing) > 1.0 - 1e-9);
    }

    if (best > 1e-4) ++missed;
    if (best < 1e-4) worst = std::max(worst, best);
  }

  CAPTURE(worst);
  CHECK(missed <= 4);  // where two solutions nearly coincide
}

TEST_CASE("three points in a line, or one point three times, give no pose and no fault") {
  Random random(2);
  const Eigen::Isometry3d truth = random_pose(random);
  const PointSighting a = sighting(truth, random);
  PointSighting b = a, c = a;
  CHECK(solve_three_points({a, a, a}).empty());

  b.point_m += Eigen::Vector3d(0.5, 0.2, 0.1);
  c.point_m += Eigen::Vector3d(1.0, 0.4, 0.2);
  for (PointSighting* const pair : {&b, &c}) pair->bearing = (truth * pair->point_m).normalized();
  CHECK(solve_three_points({a, b, c}).empty());
}

TEST_CASE("exact pairs give the exact pose after few samples") {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Isometry3d truth = random_pose(random);
    const auto pairs = pairs_with_outliers(truth, 30, 0, 0.0, random);
    const AbsolutePose found = find_absolute_pose(pairs, {}, 7);
    REQUIRE(found.is_found);
    CHECK(found.inliers.size() == 30);
    CHECK(found.iterations <= 5);
    CHECK(place_error(found.camera_T_map, truth) < 1e-7);
    CHECK(rotation_error(found.camera_T_map, truth) < 1e-7);
  }
}

TEST_CASE("wrong pairs are found out; more of them cost more samples") {
  Random random(4);
  AbsolutePoseParameters parameters;
  int few = 0, many = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const Eigen::Isometry3d truth = random_pose(random);
    const auto mostly_good = pairs_with_outliers(truth, 60, 20, 0.0015, random);
    const auto mostly_bad = pairs_with_outliers(truth, 40, 120, 0.0015, random);
    const AbsolutePose a = find_absolute_pose(mostly_good, parameters, 1);
    const AbsolutePose b = find_absolute_pose(mostly_bad, parameters, 1);
    REQUIRE(a.is_found);
    REQUIRE(b.is_found);
    CHECK(place_error(a.camera_T_map, truth) < 0.05);
    CHECK(place_error(b.camera_T_map, truth) < 0.08);
    CHECK(a.rms_rad == Approx(0.0015).epsilon(0.35));
    few += a.iterations;
    many += b.iterations;
  }
  CHECK(many > 5 * few);
}

TEST_CASE("the covariance is that of the errors") {
  Random random(5);
  double sum = 0.0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Isometry3d truth = random_pose(random);
    const auto pairs = pairs_with_outliers(truth, 50, 10, 0.0015, random);
    const AbsolutePose found = find_absolute_pose(pairs, {}, static_cast<std::uint64_t>(trial));
    REQUIRE(found.is_found);
    // truth = (exp(rotation), translation) * estimate
    const Eigen::Isometry3d off = truth * found.camera_T_map.inverse();
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(off.linear()));
    Eigen::Matrix<double, 6, 1> error;
    error << turn.angle() * turn.axis(), off.translation();
    sum += error.dot(found.covariance.inverse() * error);
  }
  CHECK(sum / kTrials == Approx(6.0).epsilon(0.15));
}

TEST_CASE("pairs that fit no pose are told as such; the same seed gives the same") {
  Random random(6);
  const Eigen::Isometry3d truth = random_pose(random);
  const auto wrong = pairs_with_outliers(truth, 0, 100, 0.0, random);
  AbsolutePoseParameters parameters;
  parameters.max_iterations = 300;
  const AbsolutePose none = find_absolute_pose(wrong, parameters, 3);
  CHECK_FALSE(none.is_found);
  CHECK(none.iterations == 300);
  CHECK_FALSE(find_absolute_pose(std::span(wrong).first(2), parameters, 3).is_found);

  const auto pairs = pairs_with_outliers(truth, 40, 40, 0.001, random);
  const AbsolutePose a = find_absolute_pose(pairs, parameters, 11);
  const AbsolutePose b = find_absolute_pose(pairs, parameters, 11);
  CHECK(a.camera_T_map.matrix() == b.camera_T_map.matrix());
  CHECK(a.inliers == b.inliers);
  CHECK(a.iterations == b.iterations);
}

namespace {

/// What stands, and a thing 8 m ahead with three times as many points that was moved by half a
/// metre since it was mapped, weighed so that it counts once.
struct MovedThing {
  std::vector<PointSighting> pairs;
  std::vector<double> weights;
};

MovedThing beside_a_moved_thing(const Eigen::Isometry3d& truth, Random& random) {
  constexpr int kStanding = 15, kOfThing = 45;
  MovedThing scene;
  scene.pairs = pairs_with_outliers(truth, kStanding, 0, 0.0015, random);
  scene.weights.assign(kStanding, 1.0);
  for (int i = 0; i < kOfThing; ++i) {
    const Eigen::Vector3d at =
        Eigen::Vector3d(0.0, 0.0, 8.0) + Eigen::Vector3d(uniform(random, -1.0, 1.0),
                                                         uniform(random, -1.0, 1.0),
                                                         uniform(random, -1.0, 1.0));
    const Eigen::Vector3d noise = normal3(random, 0.0015);
    const Eigen::Vector3d mapped = at + Eigen::Vector3d(0.3, 0.0, 0.4);
    scene.pairs.push_back({(at.normalized() + noise).normalized(), truth.inverse() * mapped});
    scene.weights.push_back(1.0 / kOfThing);
  }
  return scene;
}

/// Off by what odometry is off after one frame.
PosePrior prior_near(const Eigen::Isometry3d& truth, Random& random) {
  const Eigen::Vector3d turn = normal3(random, 0.005), shift = normal3(random, 0.01);
  PosePrior prior;
  prior.camera_T_map = Eigen::Isometry3d(Eigen::Translation3d(shift)) *
                       Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()) * truth;
  prior.covariance.setZero();
  prior.covariance.diagonal() << 2.5e-5, 2.5e-5, 2.5e-5, 1e-4, 1e-4, 1e-4;
  return prior;
}

}  // namespace

TEST_CASE("a pose that is updated does not follow a moved thing of many points") {
  const AbsolutePoseParameters parameters{
      .sigma_rad = 0.0015, .max_iterations = 500, .min_inliers = 8};
  Random random(21);
  int followed = 0;
  double squares = 0.0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Isometry3d truth = random_pose(random);
    const MovedThing scene = beside_a_moved_thing(truth, random);
    const PosePrior prior = prior_near(truth, random);
    const AbsolutePose updated =
        update_absolute_pose(scene.pairs, scene.weights, prior, parameters, 1);
    CHECK(updated.is_found);
    CHECK(place_error(updated.camera_T_map, truth) < 0.04);
    // Without prior and weights most points decide.
    const AbsolutePose without = find_absolute_pose(scene.pairs, {}, 1);
    followed += place_error(without.camera_T_map, truth) > 0.2 ? 1 : 0;

    const Eigen::Isometry3d off = truth * updated.camera_T_map.inverse();
    const Eigen::AngleAxisd turn(off.linear());
    Eigen::Matrix<double, 6, 1> error;
    error << turn.angle() * turn.axis(), off.translation();
    squares += error.dot(updated.covariance.ldlt().solve(error));
  }
  CHECK(followed > 90);
  // The covariance is honest: 6 is the mean of chi^2, 0.35 its standard deviation.
  CHECK(squares / kTrials > 4.0);
  CHECK(squares / kTrials < 8.0);
}

TEST_CASE("without pairs that fit the prior stays") {
  Random random(22);
  const Eigen::Isometry3d truth = random_pose(random);
  const PosePrior prior = prior_near(truth, random);
  const AbsolutePose none = update_absolute_pose({}, {}, prior, {}, 1);
  CHECK_FALSE(none.is_found);
  CHECK(place_error(none.camera_T_map, prior.camera_T_map) < 1e-12);
  CHECK((none.covariance - prior.covariance).norm() < 1e-9 * prior.covariance.norm());

  // One pair is no pose, but it tells something.
  const std::vector<PointSighting> one{sighting(truth, random)};
  const std::vector<double> weight{1.0};
  const AbsolutePose little = update_absolute_pose(one, weight, prior, {.threshold_rad = 0.1}, 1);
  CHECK_FALSE(little.is_found);
  CHECK(little.covariance.determinant() < 0.5 * prior.covariance.determinant());
}
