// Errors that scans have in common: of the level, and of a trunk observed from one place.
#include <cmath>

#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"
#include "tests/ekf/filter_fixture.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

constexpr double kHeight_m = 1.5;
constexpr double kGravity = 9.81;

/// A level with the error of the accelerometer's bias until the drive shows it: roll and pitch each
/// with a standard deviation of 6 mrad that falls to 1 mrad within some seconds.
class WrongLevel {
 public:
  explicit WrongLevel(std::uint64_t seed) : random_(seed) {
    error_ = kStart * Eigen::Vector2d(normal(random_), normal(random_));
    first_error_ = error_;
  }

  /// Adds the effect of the wrong level to an increment, with its covariance.
  void spoil(model::Odometry& increment) {
    model::Preintegration& inertial = *increment.inertial;
    // While the vehicle is stationary the accelerometer's bias hides the level's error.
    const Eigen::Vector2d force = kGravity * level_displacement() * (error_ - first_error_);
    inertial.velocity_mps += force * inertial.seconds;
    inertial.position_m += 0.5 * force * inertial.seconds * inertial.seconds;
    const double before = variance_;
    if (!increment.is_stationary) {
      variance_ = std::max(kEnd * kEnd, variance_ * std::exp(-inertial.seconds / 2.0));
    }
    const double memory = variance_ / before;
    const double added = variance_ - memory * memory * before;
    const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
    inertial.level = {variance_ * one, memory * one, added * one};
    error_ = memory * error_ + std::sqrt(added) * Eigen::Vector2d(normal(random_), normal(random_));
  }
  void spoil(model::TrackedScan& scan) const {
    for (model::TrackedLandmark& landmark : scan.landmarks) {
      model::Detection& detection = landmark.observed;
      detection.position_m.z() = kHeight_m;
      detection.position_m.head<2>() += kHeight_m * level_displacement() * error_;
      const double share = kHeight_m * kHeight_m * variance_;
      detection.covariance_m2.topLeftCorner<2, 2>() += share * Eigen::Matrix2d::Identity();
      detection.covariance_m2(2, 2) = 1.0;
    }
  }

 private:
  static constexpr double kStart = 6e-3;
  static constexpr double kEnd = 1e-3;

  std::mt19937_64 random_;
  Eigen::Vector2d error_;
  Eigen::Vector2d first_error_;
  double variance_ = kStart * kStart;
};

double mean_nees_with_wrong_level(std::uint64_t seed, bool is_reported) {
  sim::InertialDriveParameters parameters = test::short_drive();
  parameters.stationary_s = 5.0;
  parameters.odometry = sim::OdometryKind::kInertialAndWheels;
  parameters.position_sigma_m = 0.02;
  parameters.range_m = 40.0;
  sim::InertialDrive drive(parameters, trunks(), seed);
  Ekf filter(test::white_noise());
  WrongLevel level(seed);
  geometry::SE2 start;
  double sum = 0.0;
  int count = 0;
  for (int k = 0; k < 200; ++k) {
    const sim::DriveStep step = drive.next();
    if (k == 0) start = step.world_T_vehicle;
    for (model::Odometry increment : step.odometry) {
      level.spoil(increment);
      if (!is_reported) increment.inertial->level = model::LevelError{};
      filter.add(increment);
    }
    model::TrackedScan scan = test::true_tracks(step);
    level.spoil(scan);
    const EkfOutput output = filter.add(scan);
    if (k < 60) continue;
    sum += test::nees(*output.pose, start.inverse() * step.world_T_vehicle);
    ++count;
  }
  return sum / count;
}

}  // namespace

TEST_CASE("A level whose error is found while driving leaves the filter consistent",
          "[ekf][level]") {
  double reported = 0.0;
  double unreported = 0.0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    reported += mean_nees_with_wrong_level(seed, true) / 12.0;
    unreported += mean_nees_with_wrong_level(seed, false) / 12.0;
  }
  CAPTURE(reported, unreported);
  CHECK(reported < 4.0);
  CHECK(reported > 1.5);
  CHECK(unreported > 2.0 * reported);
}

TEST_CASE("Landmarks observed from one place are less certain once it is left",
          "[ekf][stationary]") {
  sim::InertialDriveParameters parameters = test::short_drive();
  parameters.stationary_s = 10.0;
  EkfParameters honest;
  honest.observation.correlated_share = 0.2;
  test::Driven driven(0.0, parameters, honest);
  EkfOutput output;
  for (int k = 0; k < 104; ++k) output = driven.go();
  const double noise = parameters.position_sigma_m * parameters.position_sigma_m;
  std::size_t long_observed = 0;
  for (const model::EkfLandmark& landmark : output.map->landmarks) {
    if (landmark.observation_count < 50) continue;
    ++long_observed;
    CHECK(landmark.covariance_m2.trace() > 0.5 * 2.0 * 0.2 * noise);
  }
  CHECK(long_observed > 3);
}

namespace {

/// A vehicle that is stationary for 20 s before trunks that lean and whose heights are noisy: with
/// the height the position on the trunk moves. The level is right, but unknown. Returns the squared
/// Mahalanobis distance of the filter's estimate of the level.
double level_nees_before_leaning_trunks(std::uint64_t seed) {
  constexpr int kTrunks = 12;
  constexpr double kLevel = 5e-3;
  constexpr double kLean = 0.05;
  constexpr double kHeightNoise = 0.15;
  constexpr double kNoise = 0.01;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> trunks;
  std::vector<Eigen::Vector2d> leans;
  for (int i = 0; i < kTrunks; ++i) {
    const double bearing = 2.0 * M_PI * i / kTrunks;
    trunks.emplace_back(12.0 * std::cos(bearing), 12.0 * std::sin(bearing), kHeight_m);
    leans.emplace_back(kLean * normal(random), kLean * normal(random));
  }
  Ekf filter(test::white_noise());
  for (int k = 0; k < 200; ++k) {
    model::Odometry increment;
    increment.from_utime = model::Utime{100000} * k;
    increment.utime = increment.from_utime + 100000;
    increment.covariance = 1e-6 * Eigen::Matrix3d::Identity();
    increment.is_stationary = true;
    model::Preintegration& inertial = increment.inertial.emplace();
    inertial.seconds = 0.1;
    inertial.covariance = 1e-8 * Eigen::Matrix<double, 5, 5>::Identity();
    const double memory = 0.9996;
    inertial.level.covariance = kLevel * kLevel * Eigen::Matrix2d::Identity();
    inertial.level.memory = memory * Eigen::Matrix2d::Identity();
    inertial.level.added = (1.0 - memory * memory) * inertial.level.covariance;
    filter.add(increment);
    model::TrackedScan scan;
    scan.utime = increment.utime;
    scan.field_of_view.max_range_m = 30.0;
    for (std::uint32_t i = 0; i < kTrunks; ++i) {
      const double up = kHeightNoise * normal(random);
      model::Detection detection;
      detection.position_m = trunks[i] + Eigen::Vector3d(0.0, 0.0, up);
      detection.position_m.head<2>() +=
          up * leans[i] + kNoise * Eigen::Vector2d(normal(random), normal(random));
      const double own = kNoise * kNoise + std::pow(kLean * kHeightNoise, 2);
      detection.covariance_m2.setIdentity();
      detection.covariance_m2.topLeftCorner<2, 2>() *= own + std::pow(kHeight_m * kLevel, 2);
      scan.landmarks.push_back({i + 1, i, detection});
    }
    filter.add(scan);
  }
  const Eigen::Matrix2d spread = filter.state().covariance_block<2, 2>(ekf::kLevel, ekf::kLevel);
  const Eigen::Vector2d& level = filter.state().level;
  return level.dot(spread.llt().solve(level));
}

}  // namespace

TEST_CASE("Leaning trunks of uncertain height do not pass for an error of the level",
          "[ekf][level]") {
  double mean = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    mean += level_nees_before_leaning_trunks(seed) / 20.0;
  }
  CHECK(mean < 0.02);
}

TEST_CASE("A scale error of all distances makes the pose less certain far from the origin",
          "[ekf]") {
  const auto drive = [](double scale) {
    EkfParameters parameters = test::white_noise();
    parameters.observation.scale_sigma = scale;
    test::Driven driven(20.0, test::short_drive(), parameters);
    return driven.go();
  };
  const EkfOutput without = drive(0.0);
  const EkfOutput with = drive(0.01);
  const geometry::SE2& pose = with.pose->ekf_map_T_vehicle;
  REQUIRE(pose.translation().norm() > 20.0);
  const Eigen::Vector2d off = 0.01 * (pose.rotation().transpose() * pose.translation());
  Eigen::Matrix3d expected = without.pose->covariance;
  expected.topLeftCorner<2, 2>() += off * off.transpose();
  CHECK((with.pose->covariance - expected).norm() < 1e-12);
  const model::EkfLandmark& landmark = with.map->landmarks.front();
  const Eigen::Matrix2d more =
      landmark.covariance_m2 - without.map->landmarks.front().covariance_m2;
  CHECK((more - 1e-4 * landmark.position_m * landmark.position_m.transpose()).norm() < 1e-12);
}

namespace {

constexpr double kRoll = 5e-3;

/// A tenth of a second by IMU, without motion.
model::Odometry level_increment(int k, double yaw_rad, double pitch_tangent) {
  model::Odometry increment;
  increment.from_utime = model::Utime{100000} * k;
  increment.utime = increment.from_utime + 100000;
  increment.is_stationary = k == 0;
  model::Preintegration& inertial = increment.inertial.emplace();
  inertial.seconds = 0.1;
  inertial.yaw_rad = yaw_rad;
  inertial.covariance = 1e-14 * Eigen::Matrix<double, 5, 5>::Identity();
  inertial.level.covariance = kRoll * kRoll * Eigen::Matrix2d::Identity();
  inertial.level.pitch_tangent = pitch_tangent;
  return increment;
}

model::EkfPose pose_after(Ekf& filter, const model::Odometry& increment) {
  filter.add(increment);
  model::TrackedScan scan;
  scan.utime = increment.utime;
  scan.field_of_view.max_range_m = 30.0;
  return *filter.add(scan).pose;
}

}  // namespace

TEST_CASE("A wrong roll rotates the levelled frame, not the vehicle", "[ekf][level]") {
  EkfParameters parameters = test::white_noise();
  parameters.prior.gyro_bias_sigma = 1e-6;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const int count = 300;
  for (const double first_tangent : {0.0, 0.2}) {
    const double last_tangent = 0.2 - first_tangent;
    double mean = 0.0;
    for (int run = 0; run < count; ++run) {
      Ekf filter(parameters);
      const model::EkfPose first = pose_after(filter, level_increment(0, 0.0, first_tangent));
      REQUIRE(std::sqrt(first.covariance(2, 2)) < 0.1 * 0.2 * kRoll);
      const double turned = (last_tangent - first_tangent) * kRoll * normal(random);
      const model::EkfPose last = pose_after(filter, level_increment(1, turned, last_tangent));
      const double heading = last.ekf_map_T_vehicle.theta();
      mean += heading * heading / last.covariance(2, 2) / count;
    }
    CAPTURE(first_tangent, mean);
    CHECK(mean > 0.75);
    CHECK(mean < 1.3);
  }
}
