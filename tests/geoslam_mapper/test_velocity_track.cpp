#include "services/geoslam_mapper/smoothing/velocity_track.hpp"

#include <Eigen/Dense>
#include <random>

#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kStep_s = 0.1;
constexpr double kWheels_m = 0.02;      // per axis of a step
constexpr double kHeading_rad = 2e-4;   // of a step
constexpr double kVelocity_mps = 3e-3;  // of a step, by the IMU
constexpr double kPosition_m = 2e-4;    // likewise
const Eigen::Vector3d kScan(2e-3, 2e-3, 1e-4);

/// A vehicle in a bend that brakes and accelerates; the errors of its sensors follow `random`.
class Drive {
 public:
  explicit Drive(unsigned seed) : random_(seed) {}

  /// One step: the truth moves, odometry and the IMU measure it.
  void go_on() {
    const Eigen::Vector2d acceleration(1.5 * std::sin(0.05 * count_), 0.6);
    const geometry::SE2 turn(0.0, 0.0, 0.03);
    const Eigen::Vector2d way = kStep_s * velocity_ + 0.5 * kStep_s * kStep_s * acceleration;
    const geometry::SE2 last_T_next(way, turn.theta());
    truth = truth * last_T_next;

    step.mean =
        last_T_next * geometry::SE2(noise(kWheels_m), noise(kWheels_m), noise(kHeading_rad));
    step.covariance =
        Eigen::Vector3d(kWheels_m * kWheels_m, kWheels_m * kWheels_m, kHeading_rad * kHeading_rad)
            .asDiagonal();
    inertial.is_stationary = false;
    model::Preintegration& z = inertial.inertial;
    z.seconds = kStep_s;
    z.yaw_rad = step.mean.theta();
    const Eigen::Vector2d measured = acceleration + bias_mps2;
    z.velocity_mps = kStep_s * measured + vector(kVelocity_mps);
    z.position_m = 0.5 * kStep_s * kStep_s * measured + vector(kPosition_m);
    z.bias_jacobian.block<2, 2>(1, 1) = -kStep_s * Eigen::Matrix2d::Identity();
    z.bias_jacobian.block<2, 2>(3, 1) = -0.5 * kStep_s * kStep_s * Eigen::Matrix2d::Identity();
    z.covariance.diagonal() << kHeading_rad * kHeading_rad, kVelocity_mps * kVelocity_mps,
        kVelocity_mps * kVelocity_mps, kPosition_m * kPosition_m, kPosition_m * kPosition_m;
    velocity_ = turn.rotation().transpose() * (velocity_ + kStep_s * acceleration);
    ++count_;
  }

  /// The prediction and one scan's own pose, weighted as registration does.
  geometry::SE2WithCovariance register_scan(const geometry::SE2WithCovariance& predicted) {
    const Eigen::Matrix3d own = stated * stated * kScan.cwiseAbs2().asDiagonal();
    const geometry::SE2 scan =
        truth * geometry::SE2(noise(kScan.x()), noise(kScan.y()), noise(kScan.z()));
    const Eigen::Matrix3d weight = (own + predicted.covariance).inverse();
    const Eigen::Matrix3d gain = predicted.covariance * weight;
    return {predicted.mean * geometry::SE2::Exp(gain * (predicted.mean.inverse() * scan).Log()),
            predicted.covariance - gain * predicted.covariance};
  }

  Eigen::Vector2d bias_mps2 = Eigen::Vector2d(0.05, -0.03);  ///< Of the accelerometer.
  double stated = 1.0;  ///< Sigma of a scan's own pose that is stated, as a multiple of the true.
  geometry::SE2 truth;
  geometry::SE2WithCovariance step;
  model::InertialMotion inertial;

 private:
  double noise(double sigma) { return sigma * normal_(random_); }
  Eigen::Vector2d vector(double sigma) { return {noise(sigma), noise(sigma)}; }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Eigen::Vector2d velocity_ = Eigen::Vector2d(2.0, 0.0);
  int count_ = 0;
};

/// Mean squared error [m^2] of the positions over a drive, and the NEES of the poses.
std::pair<double, double> follow(unsigned seed, bool has_imu, double stated = 1.0) {
  Drive drive(seed);
  drive.stated = stated;
  VelocityTrack track;
  geometry::SE2WithCovariance pose;
  pose.covariance = kScan.cwiseAbs2().asDiagonal();
  double squared = 0.0;
  double nees = 0.0;
  constexpr int kScans = 200;
  for (int k = 0; k < kScans; ++k) {
    drive.go_on();
    const auto inertial = has_imu ? std::optional(drive.inertial) : std::nullopt;
    pose = drive.register_scan(track.predict(pose, drive.step, inertial));
    REQUIRE(track.update(pose));
    const Eigen::Vector3d error = (pose.mean.inverse() * drive.truth).Log();
    squared += error.head<2>().squaredNorm() / kScans;
    nees += error.dot(pose.covariance.inverse() * error) / kScans;
  }
  return {squared, nees};
}

}  // namespace

TEST_CASE("The velocity makes a scan's pose surer than its own landmarks do", "[velocity]") {
  double with_imu = 0.0;
  double without = 0.0;
  double nees = 0.0;
  constexpr int kDrives = 20;
  for (unsigned seed = 1; seed <= kDrives; ++seed) {
    const auto [squared, of_drive] = follow(seed, true);
    with_imu += squared / kDrives;
    nees += of_drive / kDrives;
    without += follow(seed, false).first / kDrives;
  }
  CHECK(with_imu < 0.6 * without);
  // Errors that scans share are allowed for; there are none here.
  CHECK(nees < 3.2);
  CHECK(nees > 1.5);
}

/// The bias must not drag poses along that are taken for less certain than they are.
TEST_CASE("An accelerometer's bias is learned beside the velocity", "[velocity]") {
  double overstated = 0.0;
  double without = 0.0;
  constexpr int kDrives = 10;
  for (unsigned seed = 31; seed < 31 + kDrives; ++seed) {
    overstated += follow(seed, true, 4.0).first / kDrives;
    without += follow(seed, false).first / kDrives;
  }
  CHECK(overstated < without);
}

TEST_CASE("An IMU that contradicts the landmarks is noticed, and forgotten", "[velocity]") {
  Drive drive(7);
  VelocityTrack track;
  geometry::SE2WithCovariance pose;
  pose.covariance = kScan.cwiseAbs2().asDiagonal();
  for (int k = 0; k < 20; ++k) {
    drive.go_on();
    pose = drive.register_scan(track.predict(pose, drive.step, drive.inertial));
    REQUIRE(track.update(pose));
  }

  drive.go_on();
  drive.inertial.inertial.position_m.y() += 0.3;
  pose = drive.register_scan(track.predict(pose, drive.step, drive.inertial));
  CHECK(!track.update(pose));
  // Then by odometry alone, and from the next scan on with a new velocity.
  pose.mean = drive.truth;
  drive.go_on();
  const auto predicted = track.predict(pose, drive.step, std::nullopt);
  CHECK(predicted.covariance(0, 0) > kWheels_m * kWheels_m);
  CHECK(track.update(drive.register_scan(predicted)));
}

TEST_CASE("A stationary vehicle stays, and starts from rest", "[velocity]") {
  VelocityTrack track;
  geometry::SE2WithCovariance pose;
  pose.covariance = kScan.cwiseAbs2().asDiagonal();
  geometry::SE2WithCovariance none;
  none.covariance = 1e-8 * Eigen::Matrix3d::Identity();
  model::InertialMotion still;
  still.is_stationary = true;
  still.inertial.seconds = kStep_s;
  REQUIRE(track.predict(pose, none, still).mean.translation().norm() == 0.0);
  REQUIRE(track.update(pose));

  // A push of 1 m/s^2: 5 mm, though odometry says 1 cm.
  model::InertialMotion push;
  push.inertial.seconds = kStep_s;
  push.inertial.velocity_mps.x() = 0.1;
  push.inertial.position_m.x() = 0.005;
  push.inertial.covariance = 1e-8 * Eigen::Matrix<double, 5, 5>::Identity();
  geometry::SE2WithCovariance wheels{geometry::SE2(0.01, 0.0, 0.0),
                                     1e-4 * Eigen::Matrix3d::Identity()};
  CHECK(track.predict(pose, wheels, push).mean.translation().x() == Approx(0.005).margin(2e-4));
}
