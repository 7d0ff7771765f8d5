// The level's error at the start of the map, as the first metres show it.
#include <cmath>
#include <numbers>
#include <vector>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/geoslam_mapper/smoothing/start_level.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr model::Utime kScan_us = 100'000;
constexpr model::Utime kKeyframe_us = 800'000;
constexpr double kHeight_m = 1.3;
constexpr int kAtRest = 5;
const Eigen::Vector2d kError_rad(-0.004, 0.007);  // Roll, pitch.
/// Of landmarks, by that error: pitch moves them forward, roll to the right.
const Eigen::Vector2d kDisplaced_m(kHeight_m* kError_rad.y(), -kHeight_m* kError_rad.x());

model::Utime begin_of(int number) { return number * kKeyframe_us + kScan_us; }

/// Eight landmarks around (0, 0), as a vehicle at (x, 0) sees them, displaced.
model::Keyframe keyframe_at(double x, int number, const Eigen::Vector2d& displaced_m) {
  model::Keyframe keyframe;
  keyframe.sequence = static_cast<std::uint64_t>(number);
  keyframe.utime = begin_of(number);
  keyframe.field_of_view.max_range_m = 60.0;
  for (int k = 0; k < 8; ++k) {
    keyframe.members.push_back({keyframe.utime + k * kScan_us, static_cast<std::uint64_t>(k),
                                geometry::SE2(), 1e-8 * Eigen::Matrix3d::Identity()});
  }

  for (int k = 0; k < 8; ++k) {
    const double bearing = 2.0 * std::numbers::pi * k / 8.0;
    const Eigen::Vector2d position_m((10.0 + k) * std::cos(bearing),
                                     (10.0 + k) * std::sin(bearing));
    model::KeyframeLandmark landmark;
    landmark.position_m = position_m - Eigen::Vector2d(x, 0.0) + displaced_m;
    landmark.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
    landmark.radius_m = 0.2;
    landmark.observation_count = 8;
    keyframe.landmarks.push_back(landmark);
  }
  return keyframe;
}

model::EkfLevel unknown_level() {
  model::EkfLevel level;
  level.utime = begin_of(0);
  level.covariance = 5e-3 * 5e-3 * Eigen::Matrix2d::Identity();
  return level;
}

model::RestLevel rest_until(int last) {
  model::RestLevel level;
  level.rest_from_utime = 0;
  level.rest_utime = begin_of(last) + kKeyframe_us - kScan_us;
  level.utime = level.rest_utime + kKeyframe_us;
  level.error_rad = kError_rad;
  level.covariance = 1e-6 * Eigen::Matrix2d::Identity();
  level.change_covariance = 4e-6 * Eigen::Matrix2d::Identity();
  return level;
}

/// Five keyframes at rest with a wrong level, then two metres on with a right one.
struct Drive {
  SmoothingMapper mapper{SmoothingMapperParameters{}};
  int number = 0;

  Drive() {
    mapper.add(unknown_level());
    for (; number < kAtRest; ++number) mapper.add(keyframe_at(0.0, number, kDisplaced_m));
  }
  model::MapUpdate go_on(double x) {
    model::Keyframe keyframe = keyframe_at(x, number++, Eigen::Vector2d::Zero());
    keyframe.previous_T_base = geometry::SE2(2.0, 0.0, 0.0);
    model::MapUpdate update = mapper.add(keyframe);
    REQUIRE(update.status == model::MapUpdateStatus::kUpdated);
    return update;
  }
};

double error_m(const model::MapUpdate& update, double x) {
  return (update.map_T_vehicle.translation() - Eigen::Vector2d(x, 0.0)).norm();
}

}  // namespace

TEST_CASE("The map's origin is where the vehicle stood, once its level is known", "[mapper]") {
  Drive drive;
  const model::MapUpdate before = drive.go_on(2.0);
  CHECK(error_m(before, 2.0) > 0.9 * kDisplaced_m.norm());

  drive.mapper.add(rest_until(kAtRest - 1));
  const model::MapUpdate after = drive.go_on(4.0);
  CHECK(error_m(after, 4.0) < 1e-3);
  // 5 mrad and 1 mrad at breast height, beside 4 mm by what the landmarks leave open.
  CHECK(std::sqrt(before.covariance(0, 0)) > 7e-3);
  CHECK(std::sqrt(after.covariance(0, 0)) < 4.5e-3);

  // Keyframes at rest stay where the vehicle was; what came after moves with the map.
  const auto keyframes = drive.mapper.trajectory();
  REQUIRE(keyframes.size() == kAtRest + 2);
  for (int k = 0; k < kAtRest; ++k)
    CHECK(keyframes[static_cast<std::size_t>(k)].map_T_vehicle.translation().norm() < 1e-3);
  CHECK((keyframes[kAtRest].map_T_vehicle.translation() - Eigen::Vector2d(2.0, 0.0)).norm() < 1e-3);

  // The landmarks of before are those of now.
  for (const model::MapLandmark& landmark : drive.mapper.landmarks())
    CHECK(std::abs(landmark.position_m.norm() - std::round(landmark.position_m.norm())) < 2e-3);
  CHECK(drive.mapper.landmarks().size() == 8);
}

TEST_CASE("A rest that was not at the start of the map moves nothing", "[mapper]") {
  Drive drive;
  model::RestLevel later = rest_until(kAtRest + 3);
  later.rest_from_utime = begin_of(1);
  drive.mapper.add(later);
  CHECK(error_m(drive.go_on(2.0), 2.0) > 0.9 * kDisplaced_m.norm());
}

TEST_CASE("What the filter knew of the level at the start is not counted twice", "[mapper]") {
  StartLevel start;
  CHECK_FALSE(start.take());
  model::EkfLevel known = unknown_level();
  known.error_rad = 0.5 * kError_rad;
  start.begin(begin_of(0), known);
  CHECK_FALSE(start.take());

  start.add(rest_until(2));
  const auto found = start.take();
  REQUIRE(found);
  CHECK((found->error_rad - 0.5 * kError_rad).norm() < 1e-12);
  CHECK(found->until == rest_until(2).rest_utime);
  CHECK_FALSE(start.take());

  // Better knowledge is taken as a difference, worse not at all.
  model::RestLevel better = rest_until(2);
  better.utime += kKeyframe_us;
  better.error_rad *= 1.1;
  better.covariance *= 0.5;
  start.add(better);
  const auto more = start.take();
  REQUIRE(more);
  CHECK((more->error_rad - 0.1 * kError_rad).norm() < 1e-12);
  CHECK(more->until == rest_until(2).utime);
  start.add(rest_until(2));
  CHECK_FALSE(start.take());
  CHECK(start.covariance() == better.covariance);
}

TEST_CASE("A level that is wrong then and now alike makes no pose uncertain", "[mapper]") {
  StartLevel start;
  start.begin(begin_of(0), unknown_level());
  CHECK(start.covariance() == unknown_level().covariance);

  // At rest, and in the first metres.
  model::RestLevel rest = rest_until(2);
  rest.covariance = unknown_level().covariance;
  rest.change_covariance.setZero();
  start.add(rest);
  CHECK(start.covariance().isZero(0.0));
  rest.change_covariance = 1e-6 * Eigen::Matrix2d::Identity();
  start.add(rest);
  CHECK(start.covariance() == rest.change_covariance);

  // Sweeps are levelled anew: what remains of the error at the start counts.
  rest.change_covariance = 1e-4 * Eigen::Matrix2d::Identity();
  rest.covariance *= 0.5;
  start.add(rest);
  CHECK(start.covariance() == rest.covariance);

  // Of another rest nothing is known.
  rest.change_covariance.setZero();
  start.add(rest);
  REQUIRE(start.covariance().isZero(0.0));
  model::RestLevel later = rest;
  later.rest_from_utime = begin_of(3);
  later.rest_utime = later.utime = begin_of(5);
  start.add(later);
  CHECK(start.covariance() == rest.covariance);
}
