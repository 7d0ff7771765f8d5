// Where the frame of a map lies in the world.
#include "deploy/cli/map_tie.hpp"

#include <random>

#include "tests/catch.hpp"
#include "tests/cli/made_up_run.hpp"

using namespace understory;
using namespace understory::test;
using cli::MapTie;
using geometry::SE2;

namespace {

/// A drive of 60 m, each pose located with 3 cm and 5 mrad, a few of them 200 m off.
std::vector<cli::MapAndWorldPose> located_drive(const SE2& world_T_map, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<cli::MapAndWorldPose> poses;
  for (int i = 0; i < 30; ++i) {
    const SE2 world_T_vehicle(900.0 + 2.0 * i, 0.02 * i * i, 0.02 * i);
    const SE2 error(0.03 * normal(random), 0.03 * normal(random), 0.005 * normal(random));
    poses.push_back({world_T_map.inverse() * world_T_vehicle * error, world_T_vehicle, 9e-4});
    if (i % 10 == 3) poses.back().map_T_vehicle = SE2(-200.0, 80.0, 3.0);
  }
  return poses;
}

config_t mapper_config(const std::string& toml) {
  config_t config{};
  config.process = "geoslam_mapper";
  config.toml = toml;
  return config;
}

constexpr model::LandmarkId kTree = (model::LandmarkId{1} << model::kLandmarkCounterBits) + 1;

/// A drive in a map: the first update is 20 mrad off, as one located keyframe may be, the others
/// are exact. A tree stands 1 km away, which the first keyframe saw, and one 3 km away that no
/// keyframe saw and that is not among the true ones.
MadeUpRun drive_in_map(const SE2& world_T_map) {
  MadeUpRun run;
  model::WholeMap map;
  for (int i = 0; i <= 100; ++i) {
    const SE2 truth(i, 0.0, 0.1);
    run.truth(0.1 * i, truth);
    const SE2 error(0.0, 0.0, i == 0 ? 0.02 : 0.0);
    model::MapUpdate update;
    update.keyframe_sequence = static_cast<std::uint64_t>(i);
    update.utime = MadeUpRun::at(0.1 * i);
    update.status = model::MapUpdateStatus::kUpdated;
    update.map_T_vehicle = update.map_T_latest_vehicle = world_T_map.inverse() * truth * error;
    if (i == 0) update.associations = {{0, kTree}};
    run.send(0.1 * i, "SLAM_UPDATE", update);
    map.keyframes.push_back({static_cast<std::uint64_t>(i), MadeUpRun::at(0.1 * i),
                             world_T_map.inverse() * truth * error,
                             0.01 * Eigen::Matrix3d::Identity()});
  }
  model::MapLandmark tree;
  tree.id = kTree;
  tree.position_m = world_T_map.inverse() * Eigen::Vector2d(1000.0, 50.0);
  tree.covariance_m2 = 0.01 * Eigen::Matrix2d::Identity();
  map.landmarks.push_back(tree);
  tree.id = kTree + 1;
  tree.position_m = world_T_map.inverse() * Eigen::Vector2d(3000.0, -50.0);
  map.landmarks.push_back(tree);
  truth_landmarks_t truth{};
  truth.num_landmarks = 1;
  truth.landmarks.emplace_back();
  truth.landmarks[0].position_m[0] = 1000.0;
  truth.landmarks[0].position_m[1] = 50.0;
  run.send(0.0, "TRUTH_LANDMARKS", truth);
  run.map(11.0, map);
  return run;
}

}  // namespace

TEST_CASE("A given map in the world's frame is tied there", "[cli]") {
  std::mt19937_64 random(1);
  for (int round = 0; round < 50; ++round) {
    const auto tied = cli::fitted_frame(located_drive({}, random));
    CHECK(tied.tie == MapTie::kWorld);
    CHECK(tied.world_T_map.translation().isZero(0.0));
    CHECK(tied.world_T_map.theta() == 0.0);
  }
}

TEST_CASE("A given map with a frame of its own is tied where its poses fit", "[cli]") {
  std::mt19937_64 random(2);
  for (int round = 0; round < 50; ++round) {
    std::uniform_real_distribution<double> anywhere(-500.0, 500.0);
    const SE2 world_T_map(anywhere(random), anywhere(random), 0.006 * anywhere(random));
    const auto tied = cli::fitted_frame(located_drive(world_T_map, random));
    CHECK(tied.tie == MapTie::kBestFit);
    // Where the drive was, and along it.
    const Eigen::Vector2d middle_m(930.0, 4.0);
    const SE2 error = world_T_map.inverse() * tied.world_T_map;
    const Eigen::Vector2d there = world_T_map.inverse() * middle_m;
    CHECK((error * there - there).norm() < 0.05);
    CHECK(std::abs(error.theta()) < 0.004);
  }
}

TEST_CASE("A given map hangs where its poses are known best", "[cli]") {
  // Bent along the way: 40 cm off at the end, as its poses state.
  const SE2 world_T_map(300.0, -20.0, 1.0);
  std::vector<cli::MapAndWorldPose> poses;
  for (int i = 0; i < 100; ++i) {
    const SE2 world_T_vehicle(10.0 * i, 0.0, 0.0);
    const double bent_m = 0.4 * std::pow(i / 100.0, 2);
    poses.push_back({world_T_map.inverse() * SE2(10.0 * i, bent_m, 0.0), world_T_vehicle,
                     std::pow(0.01 + bent_m, 2)});
  }
  const auto tied = cli::fitted_frame(poses);
  for (std::size_t i = 0; i < 10; ++i) {
    const Eigen::Vector2d there = tied.world_T_map * poses.at(i).map_T_vehicle.translation();
    CHECK((there - poses.at(i).world_T_vehicle.translation()).norm() < 0.02);
  }
}

TEST_CASE("One pose is enough to tie a given map", "[cli]") {
  const SE2 world_T_map(5.0, 6.0, 0.7);
  const SE2 pose(1.0, 2.0, 3.0);
  const auto tied = cli::fitted_frame({{world_T_map.inverse() * pose, pose, 1.0}});
  CHECK((tied.world_T_map.translation() - world_T_map.translation()).norm() < 1e-9);
  CHECK(tied.world_T_map.theta() == Approx(0.7));
}

TEST_CASE("An error of the first keyframe does not turn a map that was given", "[cli]") {
  for (const SE2& world_T_map : {SE2(), SE2(300.0, -20.0, 1.0)}) {
    auto by_config = drive_in_map(world_T_map);
    by_config.send(0.0, "CONFIG", mapper_config("[input]\nmap_file = \"forest.gpkg\"\n"));
    auto by_message = drive_in_map(world_T_map);
    by_message.send(0.0, "GIVEN_MAP", model::WholeMap{});
    for (const auto& run : {by_config, by_message}) {
      const auto accuracy = run.accuracy();
      REQUIRE(accuracy);
      REQUIRE(accuracy->landmarks.errors_m.size() == 1);
      CHECK(accuracy->landmarks.errors_m[0] < 0.2);
      CHECK(cli::rms(cli::position_errors_m(accuracy->keyframes)) < 0.01);
    }
  }
}

TEST_CASE("A map that was not given is tied where it starts", "[cli]") {
  for (const std::string toml : {"[input]\nmap_file = \"\"\n", "[input]\n", "x = [[[\n", ""}) {
    auto run = drive_in_map({});
    run.send(0.0, "CONFIG", mapper_config(toml));
    const auto accuracy = run.accuracy();
    REQUIRE(accuracy);
    CHECK(accuracy->tied_at == MapTie::kFirstKeyframe);
    REQUIRE(accuracy->landmarks.errors_m.size() == 2);
    CHECK(accuracy->landmarks.errors_m[0] > 15.0);
    CHECK(accuracy->landmarks.errors_m[1] > 1900.0);
  }

  // A map that a lost mapper began beside the given one is its own.
  auto run = drive_in_map(SE2(300.0, -20.0, 1.0));
  run.send(0.0, "CONFIG", mapper_config("[input]\nmap_file = \"forest.gpkg\"\n"));
  run.truth(20.0, SE2(7.0, 8.0, 0.3));
  model::MapUpdate start;
  start.keyframe_sequence = 500;
  start.utime = MadeUpRun::at(20.0);
  start.status = model::MapUpdateStatus::kFirstMap;
  start.map_id = 2;
  run.send(20.0, "SLAM_UPDATE", start);
  CHECK(run.accuracy()->tied_at == MapTie::kFirstMap);
}
