#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "eval/harness/run.hpp"
#include "eval/harness/summary.hpp"
#include "eval/metrics/oracle.hpp"
#include "tests/catch.hpp"
#include "tests/eval/small_drive.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

struct Observation {
  std::size_t scan;
  std::uint32_t trunk;
  Eigen::Vector2d position_m;
};

std::vector<Observation> observations_of(const eval::harness::RecordedDrive& recorded) {
  std::vector<Observation> all;
  for (std::size_t k = 0; k < recorded.scans.size(); ++k) {
    for (std::size_t i = 0; i < recorded.scans[k].trunks.size(); ++i) {
      all.push_back({k, recorded.scans[k].trunks[i],
                     recorded.scans[k].scan.detections[i].position_m.head<2>()});
    }
  }
  return all;
}

void feed(eval::metrics::BatchOracle& oracle, const eval::harness::RecordedDrive& recorded) {
  for (const sim::SimulatedScan& scan : recorded.scans) {
    std::vector<Eigen::Vector2d> positions;
    for (const model::Detection& d : scan.scan.detections)
      positions.emplace_back(d.position_m.head<2>());
    oracle.add(positions, scan.trunks);
  }
}

/// All unknowns in one vector, residuals in the vehicle's frame, Jacobian by central differences,
/// Gauss-Newton by QR: nothing in common with the oracle's own method.
class DenseBatch {
 public:
  DenseBatch(const eval::metrics::BatchOracle& start, std::vector<Observation> observations)
      : oracle_(start), observations_(std::move(observations)) {
    poses_ = static_cast<Eigen::Index>(start.scans()) - 1;
    x_ = Eigen::VectorXd::Zero(3 * poses_ +
                               2 * static_cast<Eigen::Index>(start.landmarks_m().size()));
    for (Eigen::Index k = 0; k < poses_; ++k) {
      x_.segment<3>(3 * k) = start.first_T_vehicle(static_cast<std::size_t>(k + 1)).coordinates();
    }
    for (std::size_t i = 0; i < start.landmarks_m().size(); ++i) {
      x_.segment<2>(3 * poses_ + 2 * static_cast<Eigen::Index>(i)) = start.landmarks_m()[i];
    }
  }

  void perturb(std::mt19937_64& random, double sigma) {
    std::normal_distribution<double> normal(0.0, sigma);
    for (double& value : x_) value += normal(random);
  }

  void solve() {
    for (int i = 0; i < 20; ++i) {
      const Eigen::MatrixXd jacobian = numerical_jacobian();
      const Eigen::VectorXd step = jacobian.householderQr().solve(-residuals(x_));
      x_ += step;
      information_ = jacobian.transpose() * jacobian;
      if (step.cwiseAbs().maxCoeff() < 1e-10) return;
    }
  }

  geometry::SE2 pose(std::size_t scan) const {
    if (scan == 0) return {};
    const auto at = 3 * (static_cast<Eigen::Index>(scan) - 1);
    return {x_(at), x_(at + 1), x_(at + 2)};
  }
  Eigen::Vector2d landmark(int i) const { return x_.segment<2>(3 * poses_ + 2 * i); }
  /// Of (x, y, theta) in the map, unit noise.
  Eigen::Matrix3d covariance(std::size_t scan) const {
    const auto at = 3 * (static_cast<Eigen::Index>(scan) - 1);
    return Eigen::MatrixXd(information_.inverse()).block<3, 3>(at, at);
  }

 private:
  Eigen::VectorXd residuals(const Eigen::VectorXd& x) const {
    Eigen::VectorXd all(2 * static_cast<Eigen::Index>(observations_.size()));
    Eigen::Index row = 0;
    for (const Observation& observation : observations_) {
      const auto at = 3 * (static_cast<Eigen::Index>(observation.scan) - 1);
      const geometry::SE2 pose =
          observation.scan == 0 ? geometry::SE2() : geometry::SE2(x(at), x(at + 1), x(at + 2));
      const Eigen::Vector2d landmark =
          x.segment<2>(3 * poses_ + 2 * oracle_.landmark_of(observation.trunk));
      all.segment<2>(row) = pose.inverse() * landmark - observation.position_m;
      row += 2;
    }
    return all;
  }

  Eigen::MatrixXd numerical_jacobian() const {
    Eigen::MatrixXd jacobian(2 * static_cast<Eigen::Index>(observations_.size()), x_.size());
    const double h = 1e-5;
    for (Eigen::Index c = 0; c < x_.size(); ++c) {
      Eigen::VectorXd plus = x_;
      Eigen::VectorXd minus = x_;
      plus(c) += h;
      minus(c) -= h;
      jacobian.col(c) = (residuals(plus) - residuals(minus)) / (2.0 * h);
    }
    return jacobian;
  }

  const eval::metrics::BatchOracle& oracle_;
  std::vector<Observation> observations_;
  Eigen::Index poses_ = 0;
  Eigen::VectorXd x_;
  Eigen::MatrixXd information_;
};

}  // namespace

TEST_CASE("The oracle finds the minimum that a dense solver finds, with its covariance",
          "[oracle]") {
  const double sigma = GENERATE(0.05, 0.4);
  sim::DriveParameters parameters = test::small_drive_parameters(3.0);
  parameters.sensor.position_sigma_m = sigma;
  parameters.sensor.detection_probability = 0.8;
  const eval::harness::RecordedDrive recorded(parameters, 5);
  eval::metrics::BatchOracle oracle;
  feed(oracle, recorded);
  CHECK(oracle.solve(1e-9).converged);

  DenseBatch dense(oracle, observations_of(recorded));
  std::mt19937_64 random(1);
  dense.perturb(random, 0.02);
  dense.solve();
  for (std::size_t scan = 0; scan < oracle.scans(); ++scan) {
    REQUIRE((dense.pose(scan).inverse() * oracle.first_T_vehicle(scan)).Log().norm() < 1e-6);
  }
  for (int i = 0; i < static_cast<int>(oracle.landmarks_m().size()); ++i) {
    REQUIRE((dense.landmark(i) - oracle.landmarks_m()[i]).norm() < 1e-9);
  }
  const std::size_t last = oracle.scans() - 1;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = dense.pose(last).rotation().transpose();
  const Eigen::Matrix3d expected = sigma * sigma * turn * dense.covariance(last) * turn.transpose();
  // The dense Jacobian keeps the term that Gauss-Newton in the map's frame leaves to the residual.
  CHECK((oracle.covariance(last, sigma) - expected).norm() < 2e-4 * expected.norm());
}

TEST_CASE("Solved at every step or once at the end, the estimate is the same", "[oracle]") {
  const eval::harness::RecordedDrive recorded(test::small_drive_parameters(12.8), 6);
  const std::atomic<bool> stop{false};
  eval::metrics::BatchOracle once;
  feed(once, recorded);
  once.solve(1e-9);
  const eval::harness::RunResult stepwise = run_oracle(recorded, stop);
  REQUIRE(recorded.scans.size() == 8 * stepwise.trace.states.size());
  for (const eval::metrics::PoseEstimate& pose : stepwise.trace.final_map.poses) {
    REQUIRE((pose.map_T_vehicle.inverse() * once.first_T_vehicle(pose.scan)).Log().norm() < 1e-8);
  }
}

TEST_CASE("Without noise the oracle is exact", "[oracle]") {
  sim::DriveParameters parameters = test::small_drive_parameters(12.0);
  parameters.sensor.position_sigma_m = 0.0;
  const std::atomic<bool> stop{false};
  const eval::harness::RunResult result =
      run_oracle(eval::harness::RecordedDrive(parameters, 7), stop);
  CHECK(result.score.errors.rpe_m() < 1e-9);
  CHECK(result.score.errors.lpe_m() < 1e-9);
}

TEST_CASE("The oracle's covariance tells the truth: NEES", "[oracle]") {
  sim::DriveParameters parameters = test::small_drive_parameters(6.4);
  parameters.forest.side_m = 150.0;
  const std::atomic<bool> stop{false};
  double sum = 0.0;
  const int runs = 200;
  for (int run = 0; run < runs; ++run) {
    const eval::harness::RunResult result =
        run_oracle(eval::harness::RecordedDrive(parameters, 100 + run), stop);
    sum += result.score.nees.back().second;
  }
  const auto [low, high] = eval::harness::chi2_band_95(3.0 * runs);
  CHECK(sum > low);
  CHECK(sum < high);
}

TEST_CASE("Marks tell the oracle which poses and trunks to give", "[oracle]") {
  const eval::harness::RecordedDrive recorded(test::small_drive_parameters(12.0), 6);
  const std::atomic<bool> stop{false};
  const std::vector<eval::harness::StateMark> marks{{16, {8}, recorded.scans[8].trunks},
                                                    {32, {8, 20}, {recorded.scans[8].trunks[0]}}};
  const eval::harness::RunResult result = run_oracle(recorded, marks, stop);
  CHECK(result.score.errors.poses == 3);
  CHECK(result.score.errors.landmarks == recorded.scans[8].trunks.size() + 1);
  CHECK(result.trace.final_map.poses[0].map_T_vehicle.Log().norm() < 1e-12);
  CHECK(result.trace.final_map.poses[1].scan == 20);
  CHECK(result.score.errors.rpe_m() < 0.03);
}

TEST_CASE("A scan that shares no trunk with the rest is refused", "[oracle]") {
  eval::metrics::BatchOracle oracle;
  const std::vector<Eigen::Vector2d> positions{{1, 2}, {3, 4}};
  oracle.add(positions, std::vector<std::uint32_t>{1, 2});
  CHECK_THROWS_AS(oracle.add(positions, std::vector<std::uint32_t>{2, 3}), std::invalid_argument);
}
