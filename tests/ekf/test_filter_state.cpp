#include "services/ekf/chi_squared.hpp"
#include "services/ekf/state_covariances.hpp"
#include "services/ekf/subtract_product.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/filter_fixture.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

TEST_CASE("The dense kernel subtracts what Eigen does", "[ekf][kernel]") {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const int rows = 1 + static_cast<int>(random() % 60);
    const int columns = 1 + static_cast<int>(random() % 40);
    const int depth = 1 + static_cast<int>(random() % 32);
    Eigen::MatrixXd out = Eigen::MatrixXd::Random(72, 48);
    Eigen::MatrixXd a = Eigen::MatrixXd::Random(80, 32);
    Eigen::MatrixXd b = Eigen::MatrixXd::Random(56, 32);
    const Eigen::MatrixXd expected =
        out.topLeftCorner(rows, columns) -
        a.topLeftCorner(rows, depth) * b.topLeftCorner(columns, depth).transpose();
    subtract_product({out.data(), out.outerStride()}, {a.data(), a.outerStride()},
                     {b.data(), b.outerStride()}, rows, columns, depth, false);
    REQUIRE((out.topLeftCorner(rows, columns) - expected).cwiseAbs().maxCoeff() < 1e-12);

    Eigen::MatrixXd square = Eigen::MatrixXd::Random(72, 72);
    const Eigen::MatrixXd less =
        square.topLeftCorner(rows, rows) -
        a.topLeftCorner(rows, depth) * a.topLeftCorner(rows, depth).transpose();
    subtract_product({square.data(), square.outerStride()}, {a.data(), a.outerStride()},
                     {a.data(), a.outerStride()}, rows, rows, depth, true);
    const Eigen::MatrixXd error = square.topLeftCorner(rows, rows) - less;
    REQUIRE(error.triangularView<Eigen::Lower>().toDenseMatrix().cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("Quantiles of the chi-squared distribution agree with its tables", "[ekf]") {
  REQUIRE(chi_squared_quantile(0.95, 2) == Approx(5.991).epsilon(1e-4));
  REQUIRE(chi_squared_quantile(0.999, 2) == Approx(13.816).epsilon(1e-4));
  REQUIRE(chi_squared_quantile(0.95, 4) == Approx(9.488).epsilon(1e-4));
  REQUIRE(chi_squared_quantile(0.999, 20) == Approx(45.315).epsilon(1e-4));
  REQUIRE(chi_squared_quantile(0.975, 300) == Approx(349.874).epsilon(1e-5));
  REQUIRE(chi_squared_quantile(0.025, 300) == Approx(253.912).epsilon(1e-5));
}

TEST_CASE("A correction and the error that it undoes are one", "[ekf][state]") {
  std::mt19937_64 random(2);
  for (const ErrorForm form : test::kForms) {
    const FilterState state = random_state(form, 3, random);
    FilterState moved = state;
    Eigen::VectorXd delta = 1e-5 * Eigen::VectorXd::Random(state.size());
    moved.retract(delta);
    REQUIRE((difference(state, moved) - delta).norm() < 1e-8);
  }
}

TEST_CASE("A removed landmark leaves the rest as it was", "[ekf][state]") {
  std::mt19937_64 random(3);
  for (const std::size_t removed : {0u, 2u, 4u}) {
    FilterState state = random_state(ErrorForm::kRightInvariant, 5, random);
    const Eigen::MatrixXd before = full_covariance(state);
    state.remove_landmark(removed);
    std::vector<int> kept;
    for (int i = 0; i < before.rows(); ++i) {
      if (i / 2 != FilterState::row(removed) / 2) kept.push_back(i);
    }
    const Eigen::MatrixXd expected = before(kept, kept);
    REQUIRE(full_covariance(state) == expected);
    REQUIRE(state.landmarks().size() == 4);
  }
}

TEST_CASE("A new landmark's covariance is that of its observation and of the pose",
          "[ekf][state]") {
  std::mt19937_64 random(4);
  for (const ErrorForm form : test::kForms) {
    FilterState state = random_state(form, 2, random);
    const int n = state.size();
    const Eigen::Vector2d observed(7.0, -3.0);
    Eigen::Matrix2d noise;
    noise << 0.04, 0.01, 0.01, 0.09;
    FilterState added = state;
    added.add_landmark({}, observed, noise, 1.5);
    // The Jacobian of the whole new state with respect to the old one, by differences.
    Eigen::MatrixXd jacobian(n + 2, n);
    for (int k = 0; k < n; ++k) {
      FilterState moved = state;
      moved.retract(1e-6 * Eigen::VectorXd::Unit(n, k));
      moved.add_landmark({}, observed, noise, 1.5);
      jacobian.col(k) = difference(added, moved) / 1e-6;
    }
    Eigen::MatrixXd expected = jacobian * full_covariance(state) * jacobian.transpose();
    const Eigen::Matrix2d rotation = rotation_of(state.heading);
    expected.bottomRightCorner<2, 2>() += rotation * noise * rotation.transpose();
    REQUIRE((full_covariance(added) - expected).norm() < 1e-5 * expected.norm());
  }
}

TEST_CASE("Moving the anchor changes no covariance in the map's frame", "[ekf][state]") {
  std::mt19937_64 random(5);
  for (const ErrorForm form : test::kForms) {
    FilterState state = random_state(form, 4, random);
    state.position += Eigen::Vector2d(400.0, -300.0);
    const geometry::SE2 pose = vehicle_pose(state);
    const Eigen::Matrix3d covariance = pose_covariance(state);
    const Eigen::Matrix2d landmark = landmark_covariance(state, 2);
    const Eigen::Vector2d place = state.anchor_m + state.landmarks()[2].position;
    state.follow_with_anchor();
    REQUIRE(state.position.norm() < 1.0);
    REQUIRE((vehicle_pose(state).inverse() * pose).Log().norm() < 1e-9);
    REQUIRE((pose_covariance(state) - covariance).norm() < 1e-9 * covariance.norm());
    REQUIRE((landmark_covariance(state, 2) - landmark).norm() < 1e-9 * covariance.norm() * 1e4);
    REQUIRE((state.anchor_m + state.landmarks()[2].position - place).norm() < 1e-9);
  }
}

TEST_CASE("The pose's covariance is the one that was set", "[ekf][state]") {
  std::mt19937_64 random(6);
  for (const ErrorForm form : test::kForms) {
    FilterState state = random_state(form, 2, random);
    const Eigen::Matrix3d root = Eigen::Matrix3d::Random();
    const Eigen::Matrix3d wanted = root * root.transpose();
    set_pose_covariance(state, wanted);
    REQUIRE((pose_covariance(state) - wanted).norm() < 1e-9);
  }
}
