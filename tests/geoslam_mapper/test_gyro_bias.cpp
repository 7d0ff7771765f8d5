// What is learned of the gyro's bias after a stretch without landmarks straightens that stretch.
#include <algorithm>
#include <cmath>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr model::Utime kScan_us = 100'000;
constexpr double kScan_s = 0.1;
constexpr double kSpeed_mps = 8.0;
constexpr double kBias = 1e-3;       // rad/s, of which odometry knows nothing
constexpr double kGyroNoise = 2e-4;  // rad/s/sqrt(Hz)
constexpr int kScans = 8;

bool has_landmarks(double x) { return x < 120.0 || x > 280.0; }

/// Straight on along x. Posts left and right every 10 m but for a stretch without.
model::Keyframe keyframe(int number) {
  model::Keyframe result;
  result.sequence = static_cast<std::uint64_t>(number);
  const model::Utime first = number * kScans * kScan_us;
  result.utime = first;
  result.field_of_view.max_range_m = 30.0;

  for (int k = 0; k < kScans; ++k) {
    result.members.push_back({first + k * kScan_us, static_cast<std::uint64_t>(k),
                              geometry::SE2((k - 3.5) * kScan_s * kSpeed_mps, 0.0, 0.0),
                              1e-8 * Eigen::Matrix3d::Identity()});
  }

  const double here = (number * kScans + 3.5) * kScan_s * kSpeed_mps;

  for (int post = 0; post < 60; ++post) {
    const double x = 10.0 * post;
    if (!has_landmarks(x) || std::abs(x - here) > 25.0) continue;
    for (const double side : {-6.0, 7.0}) {
      model::KeyframeLandmark landmark;
      landmark.position_m = {x - here, side};
      landmark.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
      landmark.radius_m = 0.1;
      landmark.observation_count = kScans;
      result.landmarks.push_back(landmark);
    }
  }
  return result;
}

model::Odometry increment_until(model::Utime utime) {
  model::Odometry increment;
  increment.from_utime = utime - kScan_us;
  increment.utime = utime;
  increment.from_T_to = geometry::SE2::Exp({kSpeed_mps * kScan_s, 0.0, kBias * kScan_s});
  const double yaw_variance = kGyroNoise * kGyroNoise * kScan_s;
  increment.covariance = Eigen::Vector3d(1e-5, 1e-5, yaw_variance).asDiagonal();
  increment.has_wheels = true;
  increment.inertial.emplace();
  increment.inertial->seconds = kScan_s;
  increment.inertial->yaw_rad = kBias * kScan_s;
  increment.inertial->bias_jacobian(0, 0) = -kScan_s;
  increment.inertial->covariance(0, 0) = yaw_variance;
  return increment;
}

struct Drive {
  model::MapUpdate last;
  std::vector<model::KeyframePose> trajectory;
};

/// `saved_at`: after this keyframe the mapper is saved and another goes on from there.
Drive drive(double gyro_walk, int saved_at = -1, double condense_m = 0.0) {
  SmoothingMapperParameters parameters;
  parameters.condense_m = condense_m;
  parameters.use_odometry = true;
  parameters.gyro_walk = gyro_walk;
  SmoothingMapper mapper(parameters);
  Drive result;

  for (int number = 0; number < 62; ++number) {
    const model::Keyframe one = keyframe(number);
    for (const model::KeyframeMember& member : one.members) {
      if (member.utime == 0) continue;
      mapper.add(increment_until(member.utime));
    }
    result.last = mapper.add(one);
    INFO(number << " " << result.last.reason);
    REQUIRE((number == 0 || result.last.status == model::MapUpdateStatus::kUpdated));
    if (number != saved_at) continue;
    const std::string state = mapper.save();
    mapper = SmoothingMapper(parameters);
    mapper.load(state);
  }

  result.trajectory = mapper.trajectory();
  return result;
}

}  // namespace

TEST_CASE("a gyro's bias that shows later straightens the path before", "[mapper]") {
  // Almost 20 s without landmarks, 1 mrad more each.
  const Drive taken = drive(0.0);
  CHECK(std::abs(taken.last.map_T_vehicle.theta()) > 0.004);
  const Drive estimated = drive(1e-6);
  CHECK(std::abs(estimated.last.map_T_vehicle.theta()) < 3e-4);
  CHECK(std::abs(estimated.last.map_T_vehicle.y()) < 0.1 * std::abs(taken.last.map_T_vehicle.y()));
  // The path before is straight, too, not only its end.
  for (const model::KeyframePose& pose : estimated.trajectory)
    CHECK(std::abs(pose.map_T_vehicle.theta()) < 4e-4);
  const double sigma = std::sqrt(estimated.last.covariance(2, 2));
  CHECK(std::abs(estimated.last.map_T_vehicle.theta()) < 3.0 * sigma);
  CHECK(sigma < 0.004);
}

TEST_CASE("what was condensed keeps the bias as it was known then", "[mapper]") {
  const Drive condensed = drive(1e-6, -1, 20.0);
  const double sigma = std::sqrt(condensed.last.covariance(2, 2));
  CHECK(std::abs(condensed.last.map_T_vehicle.theta()) < std::min(3.0 * sigma, 6e-4));
  for (const model::KeyframePose& pose : condensed.trajectory)
    CHECK(std::abs(pose.map_T_vehicle.theta()) < 6e-4);
}

TEST_CASE("a mapper that was saved in between goes on with the same bias", "[mapper]") {
  const Drive whole = drive(1e-6);
  const Drive cut = drive(1e-6, 30);
  const geometry::SE2 between = whole.last.map_T_vehicle.inverse() * cut.last.map_T_vehicle;
  CHECK(between.translation().norm() < 1e-5);
  CHECK(std::abs(between.theta()) < 1e-7);
}
