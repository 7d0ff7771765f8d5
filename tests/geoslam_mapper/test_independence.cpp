// The filter is a gate: what it says of velocity and biases does not reach the map.
#include <random>

#include "common/model/archive.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/inertial_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

/// What the mapper says and holds after a drive; the filter's velocity and biases are as `lie`
/// says.
std::string mapped(std::uint64_t seed, double lie) {
  sim::InertialDriveParameters parameters;
  parameters.odometry = sim::OdometryKind::kInertialAndWheels;
  const sim::TrunkField field =
      sim::make_trunk_field(sim::forest_parameters(sim::ForestKind::kIntermediate), seed);
  sim::InertialDrive drive(parameters, field, seed);
  keyframer::joint::JointKeyframer keyframer({});
  SmoothingMapperParameters mapping;
  mapping.use_odometry = true;
  SmoothingMapper mapper(mapping);

  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::string said;
  for (int scan = 0; scan < 400; ++scan) {
    const sim::DriveStep step = drive.next();
    for (const model::Odometry& motion : step.odometry) {
      keyframer.add(motion);
      mapper.add(motion);
    }
    if (const auto keyframe = keyframer.add(step.scan)) {
      const model::MapUpdate update = mapper.add(*keyframe);
      said += state::save({"update", 1}, update.map_T_vehicle, update.covariance, update.chi2);
    }

    model::EkfPose pose;
    pose.utime = step.scan.utime;
    pose.ekf_map_T_vehicle = step.world_T_vehicle;
    pose.velocity_mps = lie * Eigen::Vector2d(normal(random), normal(random));
    pose.velocity_covariance = 1e-8 * Eigen::Matrix2d::Identity();
    pose.bias = 0.1 * lie * Eigen::Vector3d(normal(random), normal(random), normal(random));
    pose.bias_covariance = 1e-12 * Eigen::Matrix3d::Identity();
    mapper.add(pose);
  }
  for (const model::MapLandmark& landmark : mapper.landmarks())
    said += state::save({"landmark", 1}, landmark);
  return said;
}

}  // namespace

TEST_CASE("A filter that lies of velocity and biases changes no bit of the map", "[mapper]") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const std::string honest = mapped(seed, 0.0);
    REQUIRE(honest.size() > 10'000);
    CHECK(honest == mapped(seed, 1.0));
  }
}
