// A keyframer that was stopped and started again gives the same bytes as one that ran through.
#include <optional>
#include <stdexcept>
#include <string>

#include "common/model/archive.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/inertial_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::keyframer;
using joint::JointKeyframer;

namespace {

const sim::TrunkField& trunks() {
  static const sim::TrunkField field = [] {
    sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
    forest.side_m = 400.0;
    return sim::make_trunk_field(forest, 2);
  }();
  return field;
}

sim::InertialDriveParameters noisy_drive(sim::OdometryKind odometry) {
  sim::InertialDriveParameters drive;
  drive.speed_mps = 4.0;
  drive.loop_length_m = 300.0;
  drive.position_sigma_m = 0.1;
  drive.clutter_share = 0.1;
  drive.odometry = odometry;
  return drive;
}

/// The filter's output one scan behind, as it comes on the bus.
model::EkfLevel level(const sim::DriveStep& step) {
  model::EkfLevel level;
  level.utime = step.scan.utime;
  level.error_rad << 2e-3, -1e-3;
  level.covariance = 1e-7 * Eigen::Matrix2d::Identity();
  level.reported_covariance = 1e-6 * Eigen::Matrix2d::Identity();
  return level;
}

/// The outputs of a drive, each as bytes; the keyframer is stopped before the scan `restart`.
std::vector<std::string> outputs(const JointKeyframerParameters& parameters,
                                 sim::OdometryKind odometry, std::uint64_t seed,
                                 std::optional<int> restart) {
  sim::InertialDrive drive(noisy_drive(odometry), trunks(), seed);
  JointKeyframer stage(parameters);
  std::vector<std::string> bytes;
  for (int k = 0; k < 60; ++k) {
    if (restart == k) {
      const std::string saved = stage.save();
      stage = JointKeyframer(parameters);
      stage.load(saved);
      REQUIRE(stage.save() == saved);
    }
    sim::DriveStep step = drive.next();
    for (model::Detection& detection : step.scan.detections) detection.position_m.z() = 1.3;
    for (const model::Odometry& increment : step.odometry) stage.add(increment);
    const auto keyframe = stage.add(step.scan);
    bytes.push_back(state::save({"output", 2}, stage.take_waited(), keyframe));
    stage.add(level(step));
  }
  bytes.push_back(stage.save());
  return bytes;
}

}  // namespace

TEST_CASE("A restarted keyframer continues as if it had not stopped", "[keyframer][state]") {
  const JointKeyframerParameters parameters;
  const auto odometry = GENERATE(sim::OdometryKind::kInertialAndWheels, sim::OdometryKind::kNone);
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const auto expected = outputs(parameters, odometry, seed, std::nullopt);
    // In the middle of a keyframe, and between two.
    for (const int restart : {0, 1, 29, 32, 47}) {
      CAPTURE(static_cast<int>(odometry), seed, restart);
      REQUIRE(outputs(parameters, odometry, seed, restart) == expected);
    }
  }
}

TEST_CASE("A keyframer is restarted while its first keyframes wait", "[keyframer][state]") {
  JointKeyframerParameters parameters;
  parameters.observations_per_keyframe = 1;
  parameters.min_observations = 1;
  const auto expected = outputs(parameters, sim::OdometryKind::kNone, 1, std::nullopt);
  for (const int restart : {0, 1, 2, 3, 4, 5})
    REQUIRE(outputs(parameters, sim::OdometryKind::kNone, 1, restart) == expected);
}

TEST_CASE("Bytes of another stage are refused, and the state stays", "[keyframer][state]") {
  JointKeyframer stage{JointKeyframerParameters{}};
  sim::InertialDrive drive(noisy_drive(sim::OdometryKind::kNone), trunks(), 3);
  for (int k = 0; k < 12; ++k) stage.add(drive.next().scan);
  const std::string before = stage.save();

  REQUIRE_THROWS_AS(stage.load("no state"), std::invalid_argument);
  REQUIRE_THROWS_AS(stage.load(before.substr(0, before.size() - 1)), std::invalid_argument);
  REQUIRE_THROWS_AS(stage.load(before + "x"), std::invalid_argument);
  // The thesis's method was another one of this stage.
  REQUIRE_THROWS_AS(stage.load(state::save({"keyframer.baseline", 2}, before)),
                    std::invalid_argument);
  REQUIRE(stage.save() == before);
}
