// A mapper that was saved and loaded continues as if it had not been interrupted.
#include <cstdint>
#include <random>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kLevelSigma_rad = 2e-3;

/// What arrives with one scan.
struct Inputs {
  std::optional<model::Odometry> odometry;
  model::EkfPose pose;
  model::EkfLevel level;
  model::LandmarkScan scan;
  std::optional<model::RestLevel> rest;
  std::optional<model::Keyframe> keyframe;
};

sim::Drive circle(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.kind = sim::PathKind::kCircle;
  parameters.path.length_m = 60.0;
  parameters.sensor.position_sigma_m = 0.1;
  return {parameters, seed};
}

model::Odometry odometry_between(const sim::Drive& drive, std::size_t k, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double seconds = 1e-6 * static_cast<double>(drive.utime(k) - drive.utime(k - 1));
  const double yaw_noise = 1e-4 * normal(random);
  model::Odometry odometry;
  odometry.from_utime = drive.utime(k - 1);
  odometry.utime = drive.utime(k);
  odometry.sequence = k;
  odometry.from_T_to = drive.world_T_vehicle()[k - 1].inverse() * drive.world_T_vehicle()[k] *
                       geometry::SE2(2e-3 * normal(random), 1e-3 * normal(random), yaw_noise);
  odometry.covariance = Eigen::Vector3d(4e-6, 1e-6, 1e-8).asDiagonal();
  odometry.has_wheels = true;
  odometry.inertial.emplace();
  odometry.inertial->seconds = seconds;
  odometry.inertial->yaw_rad = odometry.from_T_to.theta();
  odometry.inertial->bias_jacobian(0, 0) = -seconds;
  odometry.inertial->covariance(0, 0) = 1e-8;
  return odometry;
}

std::vector<Inputs> inputs_of(const sim::Drive& drive, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  keyframer::joint::JointKeyframer keyframer({});
  std::vector<Inputs> result(drive.size());

  for (std::size_t k = 0; k < drive.size(); ++k) {
    Inputs& inputs = result[k];
    if (k > 0) inputs.odometry = odometry_between(drive, k, random);
    inputs.pose.utime = drive.utime(k);
    inputs.pose.ekf_map_T_vehicle = drive.world_T_vehicle()[k];
    inputs.pose.velocity_mps = {drive.parameters().speed_mps, 0.0};
    inputs.pose.velocity_covariance = 1e-4 * Eigen::Matrix2d::Identity();
    inputs.pose.bias_covariance = 1e-10 * Eigen::Matrix3d::Identity();
    inputs.level.utime = drive.utime(k);
    const double roll = kLevelSigma_rad * normal(random);
    inputs.level.error_rad = {roll, kLevelSigma_rad * normal(random)};
    inputs.level.covariance = 1e-8 * Eigen::Matrix2d::Identity();
    inputs.level.reported_covariance = 4e-6 * Eigen::Matrix2d::Identity();
    if (k == 30 || k == 150) {
      const double better = 1.0 / static_cast<double>(k);
      inputs.rest = model::RestLevel{drive.utime(k),
                                     k,
                                     0,
                                     drive.utime(9),
                                     inputs.level.error_rad,
                                     1e-9 * better * Eigen::Matrix2d::Identity(),
                                     1e-10 * Eigen::Matrix2d::Identity()};
    }
    inputs.scan = drive.scan(k).scan;
    inputs.keyframe = keyframer.add(inputs.scan);
  }
  return result;
}

struct Answers {
  std::vector<model::MapUpdate> updates;
  std::vector<std::optional<geometry::SE2WithCovariance>> located;
};

void feed(SmoothingMapper& mapper, const Inputs& inputs, Answers& answers) {
  if (inputs.odometry) mapper.add(*inputs.odometry);
  if (inputs.rest) mapper.add(*inputs.rest);
  mapper.add(inputs.pose);
  const std::optional<ScanPose> found = mapper.locate(inputs.scan);
  answers.located.push_back(found ? std::optional(found->map_T_vehicle) : std::nullopt);
  mapper.add(inputs.level);  // Serves the next scan: a loaded mapper must have it.
  if (inputs.keyframe) answers.updates.push_back(mapper.add(*inputs.keyframe));
}

/// `saved_after`: scans after which the mapper is saved and a new one continues; 0 = never.
Answers run(const std::vector<Inputs>& inputs, const SmoothingMapperParameters& parameters,
            const std::vector<model::MapLandmark>& given, std::size_t saved_after = 0) {
  SmoothingMapper mapper(parameters);
  mapper.start_with(given);
  Answers answers;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    feed(mapper, inputs[k], answers);
    if (k + 1 != saved_after) continue;
    const std::string state = mapper.save();
    mapper = SmoothingMapper(parameters);
    mapper.load(state);
  }
  return answers;
}

std::string bytes(const model::MapUpdate& update) {
  state::Writer out;
  out(update.keyframe_sequence, update.utime, update.status, update.map_T_vehicle,
      update.covariance, update.map_T_latest_vehicle, update.added, update.removed, update.merged,
      update.used_prior, update.candidates, update.inliers, update.chi2, update.degrees_of_freedom,
      update.log10_false_alarm, update.reason);
  for (const model::Association& pair : update.associations)
    out(pair.keyframe_landmark, pair.landmark_id);
  return out.take();
}

std::string bytes(const std::optional<geometry::SE2WithCovariance>& pose) {
  state::Writer out;
  out(pose);
  return out.take();
}

SmoothingMapperParameters with_odometry() {
  SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  return parameters;
}

/// Everything but the numbers that the graph's solution decides.
void require_same_decisions(const model::MapUpdate& a, const model::MapUpdate& b) {
  REQUIRE(a.keyframe_sequence == b.keyframe_sequence);
  REQUIRE(a.status == b.status);
  REQUIRE(a.used_prior == b.used_prior);
  REQUIRE(a.inliers == b.inliers);
  REQUIRE(a.added == b.added);
  REQUIRE(a.merged == b.merged);
  REQUIRE(a.reason == b.reason);
  REQUIRE(a.associations.size() == b.associations.size());
  for (std::size_t i = 0; i < a.associations.size(); ++i) {
    REQUIRE(a.associations[i].keyframe_landmark == b.associations[i].keyframe_landmark);
    REQUIRE(a.associations[i].landmark_id == b.associations[i].landmark_id);
  }
}

}  // namespace

TEST_CASE("A restarted mapper in a given map continues bit by bit", "[mapper]") {
  const sim::Drive drive = circle(31);
  const std::vector<Inputs> inputs = inputs_of(drive, 31);
  std::vector<model::MapLandmark> given;
  for (const Eigen::Vector2d& trunk : drive.forest().trunks_m) {
    model::MapLandmark landmark;
    landmark.position_m = trunk;
    landmark.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
    given.push_back(landmark);
  }
  SmoothingMapperParameters parameters = with_odometry();
  parameters.localisation_only = true;

  const Answers whole = run(inputs, parameters, given);
  REQUIRE(whole.updates.size() > 10);
  for (const std::size_t saved_after : {std::size_t{5}, inputs.size() / 2, inputs.size() / 2 + 3}) {
    const Answers restarted = run(inputs, parameters, given, saved_after);
    REQUIRE(restarted.updates.size() == whole.updates.size());
    for (std::size_t i = 0; i < whole.updates.size(); ++i)
      REQUIRE(bytes(restarted.updates[i]) == bytes(whole.updates[i]));
    for (std::size_t i = 0; i < whole.located.size(); ++i)
      REQUIRE(bytes(restarted.located[i]) == bytes(whole.located[i]));
  }
}

// The graph is saved at its estimates and linearised anew after a load: positions differ by what
// the incremental smoother leaves between its updates, and nothing else differs.
TEST_CASE("A restarted mapper extends the map as an uninterrupted one does", "[mapper]") {
  const std::vector<Inputs> inputs = inputs_of(circle(32), 32);
  const Answers whole = run(inputs, with_odometry(), {});
  REQUIRE(whole.updates.size() > 10);

  double largest_m = 0.0;
  double largest_rad = 0.0;
  for (const std::size_t saved_after : {std::size_t{5}, inputs.size() / 2}) {
    const Answers restarted = run(inputs, with_odometry(), {}, saved_after);
    REQUIRE(restarted.updates.size() == whole.updates.size());
    for (std::size_t i = 0; i < whole.updates.size(); ++i) {
      require_same_decisions(restarted.updates[i], whole.updates[i]);
      const geometry::SE2 difference =
          whole.updates[i].map_T_vehicle.inverse() * restarted.updates[i].map_T_vehicle;
      largest_m = std::max(largest_m, difference.translation().norm());
      largest_rad = std::max(largest_rad, std::abs(difference.theta()));
    }
  }
  INFO("largest difference " << largest_m << " m, " << largest_rad << " rad");
  CHECK(largest_m < 1.2e-5);
  CHECK(largest_rad < 1e-6);
}

TEST_CASE("Two mappers loaded from one state give the same bytes", "[mapper]") {
  const std::vector<Inputs> inputs = inputs_of(circle(33), 33);
  const Answers first = run(inputs, with_odometry(), {}, inputs.size() / 2);
  const Answers second = run(inputs, with_odometry(), {}, inputs.size() / 2);
  REQUIRE(first.updates.size() == second.updates.size());
  for (std::size_t i = 0; i < first.updates.size(); ++i)
    REQUIRE(bytes(first.updates[i]) == bytes(second.updates[i]));
}

TEST_CASE("The filter's track and the level are in the saved state", "[mapper]") {
  const std::vector<Inputs> inputs = inputs_of(circle(34), 34);
  SmoothingMapper mapper(with_odometry());
  Answers answers;
  for (std::size_t k = 0; k < 40; ++k) feed(mapper, inputs[k], answers);
  const std::string before = mapper.save();
  model::EkfPose pose = inputs[40].pose;
  mapper.add(pose);
  const std::string with_pose = mapper.save();
  CHECK(with_pose != before);
  mapper.add(inputs[40].level);
  CHECK(mapper.save() != with_pose);
}

TEST_CASE("Bytes that are no state leave the mapper as it is", "[mapper]") {
  const std::vector<Inputs> inputs = inputs_of(circle(35), 35);
  SmoothingMapper mapper(with_odometry());
  Answers answers;
  for (std::size_t k = 0; k < 20; ++k) feed(mapper, inputs[k], answers);
  const std::string state = mapper.save();
  for (const std::string& bytes :
       {std::string(), std::string("not a state"), state.substr(0, state.size() / 2),
        state.substr(0, state.size() - 1), state + "x"}) {
    REQUIRE_THROWS_AS(mapper.load(bytes), std::invalid_argument);
    REQUIRE(mapper.save() == state);
  }
}
