// Correlated and common-mode errors of observations are in the poses' covariances.
#include <cmath>
#include <numbers>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr model::Utime kScan_us = 100'000;
constexpr model::Utime kKeyframe_us = 800'000;

/// Eight landmarks around (0, 0), as observed by a vehicle at (x, 0) that drove `distance_m`
/// meanwhile.
model::Keyframe keyframe_at(double x, int number, double distance_m) {
  model::Keyframe keyframe;
  keyframe.sequence = static_cast<std::uint64_t>(number);
  keyframe.utime = number * kKeyframe_us + kScan_us;
  keyframe.field_of_view.max_range_m = 60.0;

  for (int k = 0; k < 8; ++k) {
    const double share = (k - 3.5) / 7.0;
    keyframe.members.push_back({keyframe.utime + k * kScan_us, static_cast<std::uint64_t>(k),
                                geometry::SE2(share * distance_m, 0.0, 0.0),
                                1e-8 * Eigen::Matrix3d::Identity()});
  }

  for (int k = 0; k < 8; ++k) {
    const double bearing = 2.0 * std::numbers::pi * k / 8.0;
    model::KeyframeLandmark landmark;
    landmark.position_m = {(10.0 + k) * std::cos(bearing) - x, (10.0 + k) * std::sin(bearing)};
    landmark.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
    landmark.radius_m = 0.2;
    landmark.observation_count = 8;
    keyframe.landmarks.push_back(landmark);
  }
  return keyframe;
}

/// Variance along x that is reported 3 m on, after as many keyframes at the start.
double variance_after(int stationary, const SmoothingMapperParameters& parameters) {
  SmoothingMapper mapper(parameters);
  for (int k = 0; k < stationary; ++k) mapper.add(keyframe_at(0.0, k, 0.0));
  model::Keyframe last = keyframe_at(3.0, stationary, 1.0);
  last.previous_T_base = geometry::SE2(2.5, 0.0, 0.0);
  const model::MapUpdate update = mapper.add(last);
  REQUIRE(update.status == model::MapUpdateStatus::kUpdated);
  return update.covariance(0, 0);
}

model::Odometry increment_until(model::Utime utime, double heading_sigma_rad) {
  model::Odometry increment;
  increment.from_utime = utime - kScan_us;
  increment.utime = utime;
  increment.covariance =
      Eigen::Vector3d(1e-7, 1e-7, heading_sigma_rad * heading_sigma_rad).asDiagonal();
  increment.has_wheels = true;
  increment.inertial.emplace();
  return increment;
}

}  // namespace

TEST_CASE("a longer halt adds nothing where errors are correlated", "[mapper]") {
  SmoothingMapperParameters white;
  CHECK(variance_after(20, white) < 0.75 * variance_after(1, white));
  SmoothingMapperParameters correlated;
  correlated.stationary_share = 1.0;
  CHECK(variance_after(20, correlated) == Approx(variance_after(1, correlated)));
  CHECK(variance_after(1, correlated) > 3.0 * variance_after(1, white));
}

TEST_CASE("the scale of distances adds a variance that grows with the distance from the origin",
          "[mapper]") {
  SmoothingMapperParameters parameters;
  const double before = variance_after(1, parameters);
  parameters.scale_sigma = 1e-2;
  CHECK(variance_after(1, parameters) - before == Approx(std::pow(2.5 * 1e-2, 2)).epsilon(0.05));
}

TEST_CASE("a map waits for the gyro's bias, but not for ever", "[mapper]") {
  SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  const auto first_map = [&](double unknown_until_s, bool has_odometry) {
    SmoothingMapper mapper(parameters);
    for (int number = 0; number < 8; ++number) {
      const model::Keyframe keyframe = keyframe_at(0.0, number, 0.0);
      for (int k = 0; has_odometry && k < 8; ++k) {
        const model::Utime utime = keyframe.utime + k * kScan_us;
        const bool unknown = 1e-6 * static_cast<double>(utime) < unknown_until_s;
        mapper.add(increment_until(utime, unknown ? 7e-3 : 3e-4));
      }
      if (mapper.add(keyframe).status == model::MapUpdateStatus::kFirstMap) return number;
    }
    return -1;
  };

  CHECK(first_map(0.0, false) == 0);
  CHECK(first_map(0.0, true) == 0);
  CHECK(first_map(0.5, true) == 1);
  CHECK(first_map(100.0, true) == 3);
}
