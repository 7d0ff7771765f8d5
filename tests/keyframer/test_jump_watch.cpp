// Whether the scans' clock has jumped against odometry.
#include "services/keyframer/joint/jump_watch.hpp"

#include <cmath>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory;
using keyframer::joint::CalibrationMatrix;
using keyframer::joint::CalibrationNumbers;
using keyframer::joint::JumpWatch;
using keyframer::joint::TwoMotions;

namespace {

constexpr double kScan_s = 0.1;
constexpr double kScan_m = 0.033;
constexpr double kScan_rad = 0.002;
constexpr double kWheels_m = 0.008;  ///< Of a scan's way.
constexpr double kGyro_rad = 2e-4;

Eigen::Matrix3d diagonal(double m, double rad) {
  return Eigen::Vector3d(m * m, m * m, rad * rad).asDiagonal();
}

/// A drive of a vehicle that bends gently at a speed that changes.
class Drive {
 public:
  explicit Drive(std::uint64_t seed, double slip = 1.0) : random_(seed), slip_(slip) {}

  /// Takes the next scan, stamped late by so much; by how many sigmas the clock seems to jump.
  double next(double late_s) {
    const Eigen::Vector3d twist = twist_at(static_cast<double>(true_.size()) * kScan_s);
    true_.push_back(true_.empty() ? geometry::SE2()
                                  : true_.back() * geometry::SE2::Exp(kScan_s * twist));
    wheels_.push_back(geometry::SE2::Exp(kScan_s * twist + noise(slip_ * kWheels_m, kGyro_rad)));
    seen_.push_back(true_.back() * geometry::SE2::Exp(noise(kScan_m, kScan_rad) - late_s * twist));
    if (true_.size() <= JumpWatch::kScans) return 0.0;

    const std::size_t then = true_.size() - 1 - JumpWatch::kScans;
    TwoMotions motions;
    motions.by_landmarks = {seen_[then].inverse() * seen_.back(),
                            2.0 * diagonal(kScan_m, kScan_rad)};
    for (std::size_t k = then + 1; k < true_.size(); ++k)
      motions.by_odometry.mean = motions.by_odometry.mean * wheels_[k];
    const double scans = JumpWatch::kScans;
    motions.by_odometry.covariance = scans * diagonal(kWheels_m, kGyro_rad);
    motions.then_twist = motions.now_twist = twist;
    motions.seconds = scans * kScan_s;
    motions.has_wheels = true;
    watch_.add(motions, CalibrationNumbers::Zero(), CalibrationMatrix::Zero());
    return watch_.late_sigmas();
  }

 private:
  static Eigen::Vector3d twist_at(double time_s) {
    return {3.0 + 0.5 * std::sin(0.3 * time_s), 0.0, 0.15 * std::sin(0.2 * time_s)};
  }
  Eigen::Vector3d noise(double m, double rad) {
    return {m * normal_(random_), m * normal_(random_), rad * normal_(random_)};
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double slip_;
  std::vector<geometry::SE2> true_;
  std::vector<geometry::SE2> wheels_;
  std::vector<geometry::SE2> seen_;
  JumpWatch watch_;
};

}  // namespace

TEST_CASE("Without a jump of the clock its sigmas are those of a standard normal",
          "[calibration]") {
  double squares = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Drive drive(seed);
    for (int k = 0; k < 600; ++k) {
      const double sigmas = drive.next(0.0);
      squares += sigmas * sigmas;
      ++count;
    }
  }
  CHECK(squares / count > 0.8);
  CHECK(squares / count < 1.1);
}

TEST_CASE("A clock that jumps by 50 ms shows within a second, either way", "[calibration]") {
  for (const double jump_s : {0.05, -0.05}) {
    double sum = 0.0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      Drive drive(seed);
      for (int k = 0; k < 250; ++k) drive.next(0.0);
      double most = 0.0;
      for (int k = 0; k < 10; ++k) {
        const double sigmas = drive.next(jump_s);
        if (std::abs(sigmas) > std::abs(most)) most = sigmas;
      }
      sum += most;
      // What stays late is no jump.
      for (int k = 0; k < 40; ++k) drive.next(jump_s);
      CHECK(std::abs(drive.next(jump_s)) < 4.25);
    }
    CAPTURE(jump_s);
    CHECK(std::copysign(1.0, sum) == std::copysign(1.0, jump_s));
    CHECK(std::abs(sum / 40.0) > 5.0);
  }
}

TEST_CASE("Wheels that slip by more than they state are no jump", "[calibration]") {
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Drive drive(seed, 3.0);
    for (int k = 0; k < 300; ++k) drive.next(0.0);
    for (int k = 0; k < 600; ++k) alarms += std::abs(drive.next(0.0)) > 4.25;
  }
  // By what they state it would be 3 sigmas of three: hundreds.
  CHECK(alarms < 12);
}
