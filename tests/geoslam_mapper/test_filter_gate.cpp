// The filter's motion as a gate.
#include <random>

#include "services/geoslam_mapper/smoothing/filter_track.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kSpeed_mps = 4.4;
constexpr double kScan_s = 0.1;
constexpr model::Utime kScan_us = 100'000;

model::EkfPose filter_pose(model::Utime utime, double x) {
  model::EkfPose pose;
  pose.utime = utime;
  pose.ekf_map_T_vehicle = geometry::SE2(x, 0.0, 0.0);
  pose.velocity_mps = {kSpeed_mps, 0.0};
  return pose;
}

/// Trees for the first 20 m; from 60 m on nothing but a pedestrian who walks along, ten metres
/// aside.
model::LandmarkScan scan_at(int k, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, 0.01);
  const double x = kSpeed_mps * kScan_s * k;
  model::LandmarkScan scan;
  scan.utime = (k + 1) * kScan_us;
  scan.sequence = static_cast<std::uint64_t>(k);
  scan.field_of_view.max_range_m = 25.0;
  const auto observe = [&](double lx, double ly) {
    model::Detection detection;
    const double dx = noise(random);
    detection.position_m = {lx - x + dx, ly + noise(random), 1.3};
    if (detection.position_m.head<2>().norm() > 25.0) return;
    detection.covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity();
    detection.radius_m = 0.2;
    scan.detections.push_back(detection);
  };

  for (int tree = 0; tree < 8; ++tree) observe(2.9 * tree, tree % 2 == 0 ? 6.0 : -7.0);
  if (x > 60.0) observe(65.0 + 1.2 * kScan_s * k - 0.27 * 60.0, 10.0);
  return scan;
}

struct Outcome {
  double largest_m = 0.0;
  int refused = 0;
};

Outcome drive(bool with_filter) {
  std::mt19937_64 random(4);
  keyframer::joint::JointKeyframer keyframer({});
  SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  SmoothingMapper mapper(parameters);
  Outcome outcome;

  for (int k = 0; k < 190; ++k) {
    const model::LandmarkScan scan = scan_at(k, random);
    if (with_filter) mapper.add(filter_pose(scan.utime, kSpeed_mps * kScan_s * k));
    if (k > 0) {
      model::Odometry odometry;
      odometry.from_utime = scan.utime - kScan_us;
      odometry.utime = scan.utime;
      odometry.from_T_to = geometry::SE2(kSpeed_mps * kScan_s, 0.0, 0.0);
      odometry.covariance = Eigen::Vector3d(8e-3, 1e-5, 1e-8).asDiagonal();
      odometry.has_wheels = true;
      keyframer.add(odometry);
      mapper.add(odometry);
    }
    const auto keyframe = keyframer.add(scan);
    if (!keyframe) continue;
    const model::MapUpdate update = mapper.add(*keyframe);
    if (update.status == model::MapUpdateStatus::kNotSure) ++outcome.refused;
    if (update.status != model::MapUpdateStatus::kUpdated) continue;
    const double truth = kSpeed_mps * (1e-6 * static_cast<double>(update.utime) - kScan_s);
    outcome.largest_m = std::max(outcome.largest_m, std::abs(update.map_T_vehicle.x() - truth));
  }
  return outcome;
}

}  // namespace

TEST_CASE("A pedestrian does not drag the map along where the filter knows better", "[mapper]") {
  const Outcome alone = drive(false);
  const Outcome gated = drive(true);
  INFO("alone " << alone.largest_m << " m, gated " << gated.largest_m << " m");
  CHECK(alone.largest_m > 2.0);
  CHECK(gated.largest_m < 0.05);
  CHECK(gated.refused > 0);
}

TEST_CASE("The filter's motion is known where it has poses near both ends", "[mapper]") {
  FilterTrack track;
  for (int k = 0; k <= 20; ++k) track.add(filter_pose(k * kScan_us, 0.44 * k));
  const auto motion = track.between(510'000, 1'540'000);
  REQUIRE(motion);
  CHECK(std::abs(motion->x() - 1.03 * kSpeed_mps) < 1e-9);
  CHECK_FALSE(track.between(510'000, 2'100'000));
  CHECK_FALSE(track.between(-100'000, 510'000));

  model::EkfPose restarted = filter_pose(2'100'000, 0.0);
  restarted.reset_counter = 1;
  track.add(restarted);
  CHECK_FALSE(track.between(1'500'000, 2'100'000));
  model::EkfPose late = filter_pose(2'000'000, 5.0);
  late.reset_counter = 1;
  track.add(late);
  CHECK(track.between(2'090'000, 2'100'000));
}
