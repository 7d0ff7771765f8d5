#include <Eigen/Dense>
#include <random>

#include "services/keyframer/joint/block_adjustment.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::keyframer;
using namespace understory::keyframer::joint;

namespace {

struct World {
  std::vector<geometry::SE2> poses;
  std::vector<Eigen::Vector2d> points;
};

World world(std::mt19937_64& random, int members, int landmarks) {
  std::uniform_real_distribution<double> where(-25.0, 25.0);
  World result;
  for (int k = 0; k < members; ++k) result.poses.emplace_back(0.2 * k, 0.01 * k * k, 0.02 * k);
  for (int i = 0; i < landmarks; ++i) result.points.emplace_back(where(random), where(random));
  return result;
}

BlockProblem problem(const World& truth, double sigma, double detection, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  BlockProblem result;
  result.local_T_member = truth.poses;
  result.landmarks = truth.points;
  for (std::uint32_t k = 0; k < truth.poses.size(); ++k) {
    for (std::uint32_t i = 0; i < truth.points.size(); ++i) {
      if (k != 0 && uniform(random) > detection) continue;
      const Eigen::Vector2d noise(normal(random), normal(random));
      result.observations.push_back({k, i,
                                     truth.poses[k].inverse() * truth.points[i] + sigma * noise,
                                     sigma * sigma * Eigen::Matrix2d::Identity()});
    }
  }
  return result;
}

}  // namespace

TEST_CASE("Without noise the block is found exactly, from a bad guess", "[block]") {
  std::mt19937_64 random(1);
  const World truth = world(random, 8, 40);
  BlockProblem block = problem(truth, 1e-6, 0.8, random);
  for (geometry::SE2& pose : block.local_T_member) pose = pose * geometry::SE2(0.2, -0.1, 0.05);
  for (Eigen::Vector2d& point : block.landmarks) point += Eigen::Vector2d(0.3, -0.2);
  const BlockEstimate estimate = adjust_block(block);
  REQUIRE(estimate.converged);
  for (std::size_t k = 1; k < truth.poses.size(); ++k) {
    const geometry::SE2 expected = truth.poses[0].inverse() * truth.poses[k];
    const geometry::SE2 actual =
        estimate.centre_T_member[0].mean.inverse() * estimate.centre_T_member[k].mean;
    REQUIRE((expected.inverse() * actual).Log().norm() < 1e-6);
  }
}

/// The stated joint covariance in the base's frame, D + J Sigma_base J^T, against many draws.
TEST_CASE("Covariances of a block agree with Monte Carlo", "[block]") {
  std::mt19937_64 random(2);
  const World truth = world(random, 8, 25);
  const double sigma = 0.2;

  double landmark_nees = 0.0;
  double base_nees = 0.0;
  const int runs = 300;
  for (int run = 0; run < runs; ++run) {
    const BlockEstimate estimate = adjust_block(problem(truth, sigma, 0.85, random));
    REQUIRE(estimate.converged);
    const geometry::SE2WithCovariance& base = estimate.centre_T_member.front();

    // A landmark in the base's frame: both errors act.
    for (std::size_t i = 0; i < truth.points.size(); ++i) {
      const geometry::SE2 base_T_centre = base.mean.inverse();
      const Eigen::Vector2d expected = base_T_centre * estimate.landmarks[i];
      Eigen::Matrix<double, 2, 3> jacobian;
      jacobian << -Eigen::Matrix2d::Identity(), -geometry::perpendicular(expected);
      const Eigen::Matrix2d rotation = base_T_centre.rotation();
      const Eigen::Matrix2d covariance =
          rotation * estimate.landmark_covariance[i] * rotation.transpose() +
          jacobian * base.covariance * jacobian.transpose();
      const Eigen::Vector2d error = truth.poses[0].inverse() * truth.points[i] - expected;
      landmark_nees += error.dot(covariance.inverse() * error) /
                       (2.0 * static_cast<double>(truth.points.size()) * runs);
    }

    // The last member in the base's frame.
    const geometry::SE2WithCovariance relative =
        compound(inverse(base), estimate.centre_T_member.back());
    const Eigen::Vector3d error =
        (relative.mean.inverse() * truth.poses[0].inverse() * truth.poses.back()).Log();
    base_nees += error.dot(relative.covariance.inverse() * error) / (3.0 * runs);
  }

  REQUIRE(landmark_nees == Approx(1.0).margin(0.02));
  // Above 1: the two members' errors sum to zero with the others', so they are not independent.
  REQUIRE(base_nees == Approx(1.0).margin(0.25));
}

TEST_CASE("Odometry between members holds a block with few landmarks together", "[block]") {
  std::mt19937_64 random(3);
  const World truth = world(random, 6, 2);
  BlockProblem block = problem(truth, 0.3, 1.0, random);
  for (std::size_t k = 0; k + 1 < truth.poses.size(); ++k) {
    const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-6, 1e-6, 1e-7).asDiagonal();
    block.motion.push_back(
        geometry::SE2WithCovariance{truth.poses[k].inverse() * truth.poses[k + 1], covariance});
  }
  const BlockEstimate estimate = adjust_block(block);
  REQUIRE(estimate.converged);
  const geometry::SE2 expected = truth.poses[0].inverse() * truth.poses[5];
  const geometry::SE2 actual =
      estimate.centre_T_member[0].mean.inverse() * estimate.centre_T_member[5].mean;
  REQUIRE((expected.inverse() * actual).Log().norm() < 1.2e-4);
}

TEST_CASE("Covariances are exactly symmetric, also of motions that nothing determines", "[block]") {
  int undetermined = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    std::mt19937_64 random(seed);
    BlockProblem block = problem(world(random, 8, 6), 1e-9, 0.4, random);
    for (BlockObservation& z : block.observations) {
      z.covariance_m2 = 0.04 * Eigen::Matrix2d::Identity();
    }

    const BlockEstimate estimate = adjust_block(block);
    if (!estimate.determined) ++undetermined;
    for (const geometry::SE2WithCovariance& member : estimate.centre_T_member) {
      REQUIRE(member.covariance == member.covariance.transpose());
      REQUIRE(member.covariance.allFinite());
    }
    for (const Eigen::Matrix2d& covariance : estimate.landmark_covariance) {
      if (covariance.hasNaN()) continue;  // Nobody observed it.
      REQUIRE(covariance == covariance.transpose());
      REQUIRE(covariance.determinant() > 0.0);
    }
  }
  CHECK(undetermined > 10);
  CHECK(undetermined < 90);
}
