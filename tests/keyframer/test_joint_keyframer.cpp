#include "services/keyframer/joint/joint_keyframer.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <random>

#include "common/model/archive.hpp"
#include "common/wire/convert.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::keyframer;
using namespace understory::keyframer::joint;

namespace {

sim::Drive drive(sim::PathKind path, double length_m, double detection, double sigma_m,
                 std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 400.0;
  parameters.path.kind = path;
  parameters.path.length_m = length_m;
  parameters.sensor.detection_probability = detection;
  parameters.sensor.position_sigma_m = sigma_m;
  return {parameters, seed};
}

std::vector<model::Keyframe> keyframes(const sim::Drive& drive, JointKeyframer& keyframer) {
  std::vector<model::Keyframe> result;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (auto keyframe = keyframer.add(drive.scan(k).scan)) result.push_back(std::move(*keyframe));
  }
  return result;
}

double nearest_trunk_m(const sim::Drive& drive, const Eigen::Vector2d& point) {
  return drive.grid().nearest(point)->distance_m;
}

}  // namespace

TEST_CASE("Every eight scans give a keyframe, at corners too", "[keyframer]") {
  const auto path =
      GENERATE(sim::PathKind::kCircle, sim::PathKind::kSquare, sim::PathKind::kTriangle);
  const sim::Drive simulated = drive(path, 80.0, 0.85, 0.2, 3);
  JointKeyframer keyframer({});
  const std::vector<model::Keyframe> made = keyframes(simulated, keyframer);
  REQUIRE(made.size() == simulated.size() / 8);
  REQUIRE(keyframer.counters().scans_unmatched == 0);
  for (std::size_t i = 1; i < made.size(); ++i) {
    REQUIRE(made[i].sequence == made[i - 1].sequence + 1);
    REQUIRE(made[i].previous_T_base);
    const geometry::SE2 truth =
        simulated.world_T_vehicle()[8 * (i - 1)].inverse() * simulated.world_T_vehicle()[8 * i];
    REQUIRE((truth.inverse() * *made[i].previous_T_base).Log().norm() < 0.23);
  }
}

TEST_CASE("Landmarks of a keyframe are trunks, each once, and as uncertain as stated",
          "[keyframer]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 60.0, 0.8, 0.3, 4);
  JointKeyframer keyframer({});
  double chi2 = 0.0;
  std::size_t count = 0;
  for (const model::Keyframe& keyframe : keyframes(simulated, keyframer)) {
    const geometry::SE2 world_T_base = simulated.world_T_vehicle()[8 * keyframe.sequence];
    const geometry::SE2WithCovariance base_T_centre = inverse(
        geometry::SE2WithCovariance{keyframe.centre_T_base(), keyframe.members.front().covariance});
    for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
      REQUIRE(landmark.observation_count >= 1);
      const double error =
          nearest_trunk_m(simulated, world_T_base * (base_T_centre.mean * landmark.position_m));
      if (error > 1.5) continue;  // Not its own trunk: counted as missing below.
      const double variance = 0.5 * landmark.covariance_m2.trace() +
                              base_T_centre.covariance(0, 0) +
                              landmark.position_m.squaredNorm() * base_T_centre.covariance(2, 2);
      chi2 += error * error / (2.0 * variance);
      ++count;
    }
  }
  REQUIRE(count > 2000);
  REQUIRE(chi2 / static_cast<double>(count) == Approx(1.0).margin(0.1));
}

TEST_CASE("A landmark with one observation is left out", "[keyframer]") {
  const sim::Drive simulated = drive(sim::PathKind::kLine, 10.0, 0.95, 0.05, 5);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> where(-35.0, 35.0);
  JointKeyframer keyframer({});

  std::size_t landmarks = 0;
  std::size_t clutter_passed = 0;
  std::size_t clutter_made = 0;
  for (std::size_t k = 0; k < simulated.size(); ++k) {
    model::LandmarkScan scan = simulated.scan(k).scan;
    for (int i = 0; i < 5; ++i) {
      model::Detection clutter = scan.detections.front();
      clutter.position_m = {where(random), where(random), 0.0};
      scan.detections.push_back(clutter);
      ++clutter_made;
    }

    const auto keyframe = keyframer.add(scan);
    if (!keyframe) continue;
    const geometry::SE2 world_T_centre =
        simulated.world_T_vehicle()[k - 7] * keyframe->centre_T_base().inverse();
    for (const model::KeyframeLandmark& landmark : keyframe->landmarks) {
      if (nearest_trunk_m(simulated, world_T_centre * landmark.position_m) > 0.6) ++clutter_passed;
      ++landmarks;
    }
  }

  REQUIRE(landmarks > 300);
  REQUIRE(clutter_made > 200);
  // Two false detections of different scans fall into one gate by chance now and then.
  REQUIRE(clutter_passed <= 2);
}

TEST_CASE("A vehicle that was carried away starts anew", "[keyframer]") {
  const sim::Drive here = drive(sim::PathKind::kLine, 10.0, 0.9, 0.1, 6);
  const sim::Drive there = drive(sim::PathKind::kLine, 10.0, 0.9, 0.1, 77);
  JointKeyframer keyframer({});
  const std::size_t first = keyframes(here, keyframer).size();
  REQUIRE(first > 3);
  model::Utime offset = here.utime(here.size() - 1) + 200000;
  std::vector<model::Keyframe> later;
  for (std::size_t k = 0; k < there.size(); ++k) {
    model::LandmarkScan scan = there.scan(k).scan;
    scan.utime = offset + there.utime(k);
    if (auto keyframe = keyframer.add(scan)) later.push_back(*keyframe);
  }
  REQUIRE(keyframer.counters().scans_unmatched == 1);
  REQUIRE(later.size() >= there.size() / 8);
  // No motion is claimed across the gap.
  const auto unlinked = std::count_if(later.begin(), later.end(),
                                      [](const model::Keyframe& k) { return !k.previous_T_base; });
  REQUIRE(unlinked == 1);
}

TEST_CASE("What was scanned before a break is in no keyframe of after it", "[keyframer]") {
  const sim::Drive here = drive(sim::PathKind::kLine, 10.0, 0.9, 0.1, 6);
  const sim::Drive there = drive(sim::PathKind::kLine, 10.0, 0.9, 0.1, 77);
  for (std::size_t before = 1; before < 8; ++before) {
    CAPTURE(before);
    JointKeyframer keyframer({});
    for (std::size_t k = 0; k < before; ++k) REQUIRE_FALSE(keyframer.add(here.scan(k).scan));

    // One scan alone is withheld, several are given out at the break.
    const model::Utime offset = here.utime(before) + 200000;
    for (std::size_t k = 0; k < 8; ++k) {
      model::LandmarkScan scan = there.scan(k).scan;
      scan.utime = offset + there.utime(k);
      const auto keyframe = keyframer.add(scan);
      REQUIRE(keyframe.has_value() == (k == 7 || (k == 0 && before > 1)));
      if (k < 7) continue;
      REQUIRE(keyframe->members.size() == 8);
      CHECK(keyframe->members.front().utime == offset + there.utime(0));
    }
    CHECK(keyframer.counters().keyframes_withheld == (before == 1 ? 1 : 0));
  }
}

TEST_CASE("A scan that is not later than the last one is refused and counted", "[keyframer]") {
  const sim::Drive simulated = drive(sim::PathKind::kLine, 4.0, 0.9, 0.1, 7);
  JointKeyframer keyframer({});
  keyframer.add(simulated.scan(1).scan);
  REQUIRE_FALSE(keyframer.add(simulated.scan(0).scan));
  REQUIRE(keyframer.counters().scans_unmatched == 1);
  REQUIRE_FALSE(keyframer.counters().last_reason.empty());
}

TEST_CASE("Who takes keyframes refuses none, however few landmarks connect their scans",
          "[keyframer]") {
  std::size_t made = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const sim::Drive simulated = drive(sim::PathKind::kCircle, 60.0, 0.2, 0.1, seed);
    JointKeyframer keyframer({});
    for (const model::Keyframe& keyframe : keyframes(simulated, keyframer)) {
      REQUIRE(wire::from_wire(wire::to_wire(keyframe)));
      ++made;
    }
  }
  CHECK(made > 90);
}

TEST_CASE("A pause ends a keyframe: odometry alone does not tie its scans", "[keyframer]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 60.0, 0.9, 0.05, 9);
  for (const std::size_t before : {1, 2, 5}) {
    JointKeyframer keyframer({});
    std::vector<model::Keyframe> made;
    const std::size_t pause_at = 16 + before;
    constexpr std::size_t kMissed = 40;
    for (std::size_t k = 0; k < pause_at + kMissed + 8; ++k) {
      if (k >= pause_at && k < pause_at + kMissed) continue;
      if (k > 0) {
        const std::size_t last = k == pause_at + kMissed ? pause_at - 1 : k - 1;
        model::Odometry step;
        step.from_utime = simulated.scan(last).scan.utime;
        step.utime = simulated.scan(k).scan.utime;
        step.from_T_to =
            simulated.world_T_vehicle()[last].inverse() * simulated.world_T_vehicle()[k];
        step.covariance = Eigen::Vector3d(0.1, 0.1, 1e-4).asDiagonal();
        keyframer.add(step);
      }
      if (auto keyframe = keyframer.add(simulated.scan(k).scan))
        made.push_back(std::move(*keyframe));
    }

    CAPTURE(before);
    REQUIRE(made.size() == 4);
    CHECK(made[2].members.size() == before);
    CHECK(made[2].landmarks.size() >= 5);
    CHECK(made[3].members.size() == 8);
    CHECK(made[3].utime == simulated.scan(pause_at + kMissed).scan.utime);
    CHECK(keyframer.counters().keyframes_withheld == 0);
  }
}

TEST_CASE("Scans that are seconds apart are no pause", "[keyframer]") {
  const sim::Drive simulated = drive(sim::PathKind::kLine, 20.0, 0.9, 0.05, 9);
  JointKeyframer keyframer({});
  std::size_t made = 0;
  for (std::size_t k = 0; k < 32; ++k) {
    model::LandmarkScan scan = simulated.scan(k).scan;
    scan.utime = static_cast<model::Utime>(k) * 4'000'000 + 1;
    const auto keyframe = keyframer.add(scan);
    if (!keyframe) continue;
    CHECK(keyframe->members.size() == 8);
    ++made;
  }
  CHECK(made == 4);
}

TEST_CASE("Keyframes of one scan each: also where tracking begins anew", "[keyframer]") {
  JointKeyframerParameters parameters;
  parameters.observations_per_keyframe = 1;
  JointKeyframer keyframer(parameters);

  // Each scan is of another forest than the one before.
  const sim::Drive here = drive(sim::PathKind::kLine, 10.0, 0.9, 0.1, 6);
  const sim::Drive there = drive(sim::PathKind::kLine, 10.0, 0.9, 0.1, 77);
  std::size_t made = 0;
  for (std::size_t k = 0; k < 20; ++k) {
    const model::LandmarkScan scan = (k % 2 == 0 ? here : there).scan(k).scan;
    const auto keyframe = keyframer.add(scan);
    std::vector<model::Keyframe> all = keyframer.take_waited();
    CHECK(all.size() == (k >= 1 && k <= 3 ? 1 : 0));  // Each waited for the break.
    if (keyframe) all.push_back(*keyframe);
    for (const model::Keyframe& one : all) {
      CHECK(one.sequence == made);
      ++made;
      CHECK_FALSE(one.previous_T_base);
      CHECK(wire::from_wire(wire::to_wire(one)));
    }
    if (keyframe) CHECK(keyframe->landmarks.size() == scan.detections.size());
  }
  CHECK(made == 20);
}

TEST_CASE("The first keyframe of one scan has the noise that the scans after it show",
          "[keyframer][noise]") {
  for (const double stated : {0.3, 1.0, 3.0}) {
    sim::DriveParameters of_drive;
    of_drive.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
    of_drive.forest.side_m = 300.0;
    of_drive.path.length_m = 20.0;
    of_drive.sensor.position_sigma_m = 0.05;
    of_drive.sensor.stated_factor = stated;
    const sim::Drive drive(of_drive, 5);
    JointKeyframerParameters parameters;
    parameters.observations_per_keyframe = 1;
    parameters.min_observations = 1;
    JointKeyframer keyframer(parameters);

    std::vector<model::Keyframe> made;
    for (std::size_t k = 0; k < 10; ++k) {
      auto keyframe = keyframer.add(drive.scan(k).scan);
      std::ranges::move(keyframer.take_waited(), std::back_inserter(made));
      if (keyframe) made.push_back(std::move(*keyframe));
      CAPTURE(stated, k);
      CHECK(made.size() == (k < 3 ? 0 : k + 1));
    }

    REQUIRE(made.size() == 10);
    for (std::size_t k = 0; k < made.size(); ++k) CHECK(made[k].sequence == k);
    for (const model::KeyframeLandmark& landmark : made.front().landmarks) {
      const double sigma_m = std::sqrt(0.5 * landmark.covariance_m2.trace());
      CHECK(sigma_m > 0.6 * 0.05);
      CHECK(sigma_m < 1.6 * 0.05);
    }
  }
}

TEST_CASE("Sigmas stated at a quarter and at four times the true ones give right keyframes",
          "[keyframer][noise]") {
  for (const double factor : {0.25, 4.0}) {
    for (std::uint64_t seed = 31; seed <= 42; ++seed) {
      sim::DriveParameters parameters;
      parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
      parameters.forest.side_m = 300.0;
      parameters.path.length_m = 60.0;
      parameters.sensor.stated_factor = factor;
      const sim::Drive drive(parameters, seed);
      keyframer::joint::JointKeyframer keyframer{keyframer::JointKeyframerParameters{}};

      std::optional<geometry::SE2> world_T_last;
      int right = 0;
      for (std::size_t k = 0; k < drive.size(); ++k) {
        const auto keyframe = keyframer.add(drive.scan(k).scan);
        if (!keyframe) continue;
        const std::size_t base = k + 1 - keyframe->members.size();
        const geometry::SE2 world_T_base = drive.world_T_vehicle()[base];
        if (world_T_last && keyframe->previous_T_base) {
          const geometry::SE2 error =
              (world_T_last->inverse() * world_T_base).inverse() * *keyframe->previous_T_base;
          CAPTURE(factor, seed, k);
          CHECK(error.translation().norm() < 0.5);
          ++right;
        }
        world_T_last = world_T_base;
      }
      CHECK(right + 4 > static_cast<int>(drive.size() / 8));
    }
  }
}

namespace {

using Spoil = std::function<void(model::Preintegration&, std::size_t)>;

/// Keyframes of a circle at constant speed, with an IMU whose k-th step is spoiled; no function =
/// without the IMU.
std::vector<model::Keyframe> with_imu(const sim::Drive& drive, const Spoil& spoil) {
  JointKeyframer keyframer({});
  std::vector<model::Keyframe> result;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    const model::LandmarkScan& scan = drive.scan(k).scan;
    if (k > 0) {
      model::Odometry step;
      step.from_utime = drive.scan(k - 1).scan.utime;
      step.utime = scan.utime;
      step.from_T_to = drive.world_T_vehicle()[k - 1].inverse() * drive.world_T_vehicle()[k];
      step.covariance = Eigen::Vector3d(1e-2, 1e-2, 1e-5).asDiagonal();

      if (spoil) {
        model::Preintegration& z = step.inertial.emplace();
        z.seconds = 1e-6 * static_cast<double>(step.utime - step.from_utime);
        z.yaw_rad = step.from_T_to.theta();
        const Eigen::Vector2d velocity(step.from_T_to.translation().norm() / z.seconds, 0.0);
        z.velocity_mps = step.from_T_to.rotation() * velocity - velocity;
        z.position_m = step.from_T_to.translation() - z.seconds * velocity;
        z.covariance.diagonal() << 1e-8, 1e-4, 1e-4, 1e-6, 1e-6;
        z.bias_jacobian(0, 0) = -z.seconds;
        z.bias_jacobian.block<2, 2>(1, 1) = -z.seconds * Eigen::Matrix2d::Identity();
        spoil(z, k);
      }
      keyframer.add(step);
    }

    if (auto keyframe = keyframer.add(scan)) result.push_back(std::move(*keyframe));
  }
  return result;
}

}  // namespace

TEST_CASE("An IMU makes a keyframe's members surer, unless it contradicts the landmarks",
          "[keyframer]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 60.0, 0.9, 0.2, 6);
  const auto plain = with_imu(simulated, nullptr);
  const auto right = with_imu(simulated, [](model::Preintegration&, std::size_t) {});
  const auto wrong = with_imu(simulated, [](model::Preintegration& z, std::size_t k) {
    z.position_m.y() += k % 2 == 0 ? 0.5 : -0.5;
  });
  const auto no_covariance =
      with_imu(simulated, [](model::Preintegration& z, std::size_t) { z.covariance *= -1.0; });
  const auto no_number = with_imu(
      simulated, [](model::Preintegration& z, std::size_t) { z.velocity_mps.x() = std::nan(""); });

  REQUIRE(plain.size() > 20);
  REQUIRE(right.size() == plain.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const auto spread = [](const model::Keyframe& keyframe) {
      return keyframe.members.front().covariance.topLeftCorner<2, 2>().trace();
    };
    CHECK(spread(right[i]) < 0.75 * spread(plain[i]));
  }
  for (const auto* spoiled : {&wrong, &no_covariance, &no_number}) {
    REQUIRE(spoiled->size() == plain.size());
    for (std::size_t i = 0; i < plain.size(); ++i) {
      CHECK((*spoiled)[i].members.front().centre_T_vehicle.coordinates() ==
            plain[i].members.front().centre_T_vehicle.coordinates());
    }
  }
}

TEST_CASE("An IMU that gave one sample between two scans holds each keyframe's scans",
          "[keyframer]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 60.0, 0.9, 0.2, 6);
  const auto one_sample = [](model::Preintegration& z, std::size_t k) {
    // Rate and force of one sample: five numbers by three, in the axes of the step's middle.
    const double t = z.seconds;
    const double yaw_rad = 1e-3 * static_cast<double>(k % 7);
    Eigen::Matrix<double, 5, 3> input = Eigen::Matrix<double, 5, 3>::Zero();
    input(0, 0) = t;
    input.block<2, 2>(1, 1) = t * Eigen::Rotation2Dd(yaw_rad).toRotationMatrix();
    input.block<2, 2>(3, 1) = 0.5 * t * input.block<2, 2>(1, 1);
    z.covariance = input * Eigen::Vector3d(1e-6, 1e-2, 1e-2).asDiagonal() * input.transpose();
  };
  const auto singular = with_imu(simulated, one_sample);
  const auto regular = with_imu(simulated, [&](model::Preintegration& z, std::size_t k) {
    one_sample(z, k);
    z.covariance.diagonal() += Eigen::Matrix<double, 5, 1>(1e-11, 1e-8, 1e-8, 1e-10, 1e-10);
  });

  REQUIRE(singular.size() > 20);
  REQUIRE(singular.size() == regular.size());
  for (std::size_t i = 0; i < singular.size(); ++i) {
    const auto spread = [](const model::Keyframe& keyframe) {
      return keyframe.members.front().covariance.topLeftCorner<2, 2>().trace();
    };
    CHECK(spread(singular[i]) == Approx(spread(regular[i])).epsilon(0.05));
  }
}
