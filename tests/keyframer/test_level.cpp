// Sweeps that were levelled with a wrong attitude, and the correction by the filter.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <random>

#include "common/model/level.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::keyframer;
using namespace understory::keyframer::joint;

namespace {

model::LandmarkScan random_scan(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-30.0, 30.0);
  std::uniform_real_distribution<double> height(-1.0, 3.0);
  model::LandmarkScan scan;
  scan.field_of_view.max_range_m = 60.0;
  for (int k = 0; k < 10; ++k) {
    model::Detection& detection = scan.detections.emplace_back();
    detection.position_m << place(random), place(random), height(random);
    detection.covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity();
  }
  return scan;
}

/// As a sensor with a wrong attitude measures it.
model::LandmarkScan tilted(model::LandmarkScan scan, const Eigen::Vector2d& error_rad) {
  const Eigen::Vector3d axis(error_rad.x(), error_rad.y(), 0.0);
  const Eigen::AngleAxisd rotation(axis.norm(), axis.normalized());
  for (model::Detection& detection : scan.detections)
    detection.position_m = rotation * detection.position_m;
  return scan;
}

model::LevelCorrection known(const Eigen::Vector2d& error_rad, double sigma_rad = 0.0,
                             double reported_sigma_rad = 0.0) {
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  model::LevelCorrection level;
  level.set({0, 0, error_rad, sigma_rad * sigma_rad * one,
             reported_sigma_rad * reported_sigma_rad * one});
  return level;
}

}  // namespace

TEST_CASE("A wrong level is corrected to second order", "[keyframer][level]") {
  const Eigen::Vector2d error_rad(5e-3, -8e-3);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const model::LandmarkScan truth = random_scan(seed);
    const model::LandmarkScan found = known(error_rad).levelled(tilted(truth, error_rad));
    for (std::size_t k = 0; k < truth.detections.size(); ++k) {
      const Eigen::Vector3d off = found.detections[k].position_m - truth.detections[k].position_m;
      // Second order: up to 43 m away, times 0.0094 rad squared.
      REQUIRE(off.head<2>().norm() < 3.4e-3);
    }
  }
}

TEST_CASE("The reported variance of the level is replaced by what the filter leaves of it",
          "[keyframer][level]") {
  constexpr double kReported = 6e-3;
  constexpr double kLeft = 1e-3;
  model::LandmarkScan scan = random_scan(3);
  for (model::Detection& detection : scan.detections) {
    const double z = detection.position_m.z();
    detection.covariance_m2.topLeftCorner<2, 2>() +=
        kReported * kReported * z * z * Eigen::Matrix2d::Identity();
  }
  const model::LandmarkScan found = known({1e-3, 0.0}, kLeft, kReported).levelled(scan);
  for (const model::Detection& detection : found.detections) {
    const double z = detection.position_m.z();
    const Eigen::Matrix2d expected = (1e-4 + kLeft * kLeft * z * z) * Eigen::Matrix2d::Identity();
    REQUIRE((detection.covariance_m2.topLeftCorner<2, 2>() - expected).norm() < 1e-9);
  }
  // A larger variance than there is cannot be removed.
  const model::LandmarkScan odd = known({1e-3, 0.0}, 0.0, 1.0).levelled(random_scan(3));
  for (const model::Detection& detection : odd.detections)
    REQUIRE(detection.covariance_m2.topLeftCorner<2, 2>().determinant() > 0.0);
}

TEST_CASE("An old level is ignored", "[keyframer][level]") {
  model::LandmarkScan scan = random_scan(2);
  scan.utime = 3'000'000;
  const model::LandmarkScan same = known({0.1, 0.1}).levelled(scan);
  for (std::size_t k = 0; k < scan.detections.size(); ++k)
    REQUIRE(same.detections[k].position_m == scan.detections[k].position_m);
}

TEST_CASE("Keyframes are at the level that the filter gives, after a restart too",
          "[keyframer][level]") {
  const Eigen::Vector2d error_rad(5e-3, -8e-3);
  JointKeyframerParameters parameters;
  parameters.observations_per_keyframe = 4;
  const model::LandmarkScan truth = random_scan(1);
  const auto keyframe_of = [&](const model::LandmarkScan& scan,
                               const Eigen::Vector2d& reported_rad) {
    JointKeyframer before(parameters);
    model::EkfLevel level;
    level.utime = 1'000'000;
    level.error_rad = reported_rad;
    before.add(level);
    JointKeyframer keyframer(parameters);
    keyframer.load(before.save());
    model::LandmarkScan at = scan;
    std::optional<model::Keyframe> made;
    for (int k = 0; k < 4; ++k) {
      at.utime = 1'000'000 + k * 100'000;
      REQUIRE_FALSE(made);
      made = keyframer.add(at);
    }
    REQUIRE(made);
    REQUIRE(made->landmarks.size() == scan.detections.size());
    return *made;
  };
  const auto farthest_off = [](const model::Keyframe& a, const model::Keyframe& b) {
    double off_m = 0.0;
    for (std::size_t k = 0; k < a.landmarks.size(); ++k)
      off_m = std::max(off_m, (a.landmarks[k].position_m - b.landmarks[k].position_m).norm());
    return off_m;
  };
  const model::Keyframe expected = keyframe_of(truth, Eigen::Vector2d::Zero());
  const model::LandmarkScan observed = tilted(truth, error_rad);
  REQUIRE(farthest_off(keyframe_of(observed, error_rad), expected) < 2.7e-3);
  REQUIRE(farthest_off(keyframe_of(observed, Eigen::Vector2d::Zero()), expected) > 0.012);
}
