// Numbers of `log accuracy` for runs that are made up so that they are known.
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "deploy/cli/accuracy_report.hpp"
#include "tests/catch.hpp"
#include "tests/cli/made_up_run.hpp"

using namespace understory;
using namespace understory::test;
using geometry::SE2;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// The world's x axis is not the map's.
const SE2 kWorld_T_map(-40.0, 7.0, 0.6);

/// 300 m straight ahead at 10 m/s with a pose every metre that is 2 % too far and 0.1 degrees to
/// the left, and a map that has a keyframe every 10 m, exact but for a sigma of 5 cm.
MadeUpRun straight_run() {
  MadeUpRun run;
  model::WholeMap map;
  for (int i = 0; i <= 300; ++i) {
    const double seconds = 0.1 * i;
    run.truth(seconds, kWorld_T_map * SE2(i, 0.0, 0.0));
    if (i == 0) run.update(seconds, SE2(), model::MapUpdateStatus::kFirstMap);
    const Eigen::Matrix3d covariance =
        i == 0 ? Eigen::Matrix3d::Zero() : Eigen::Matrix3d(0.04 * Eigen::Matrix3d::Identity());
    run.pose(seconds, SE2(1.02 * i, 0.0, i == 0 ? 0.0 : 0.1 * kDegree), covariance);
    if (i % 10 != 0) continue;
    map.keyframes.push_back({static_cast<std::uint64_t>(i / 10), MadeUpRun::at(seconds),
                             SE2(i, i == 0 ? 0.0 : 0.05, 0.0),
                             Eigen::Vector3d(0.0025, 0.0025, 1e-6).asDiagonal()});
  }
  run.map(31.0, map);
  return run;
}

void status(model::SlamPose& pose, model::MapUpdateStatus status) {
  pose.status = status;
  pose.keyframe_sequence = 0;
}

}  // namespace

TEST_CASE("ATE, RPE and NEES of a run are those of its errors", "[cli]") {
  const auto accuracy = straight_run().accuracy();
  REQUIRE(accuracy);
  const auto json = cli::accuracy_summary(*accuracy);

  // Errors of 0.02 i m: their deviation from the mean of i = 0..300, and half the length at the
  // end.
  const double deviation_m = 0.02 * std::sqrt((301.0 * 301.0 - 1.0) / 12.0);
  CHECK(json["ate"]["live"]["rms_m"].get<double>() == Approx(deviation_m));
  CHECK(json["ate"]["live"]["largest_m"].get<double>() == Approx(3.0));
  CHECK(json["ate"]["live"]["poses"] == 301);
  CHECK(json["live_max_cm"].get<double>() == Approx(600.0));
  CHECK(json["ate"]["keyframes"]["rms_m"].get<double>() < 0.05);

  const auto& rpe = json["rpe_by_path"]["live"];
  REQUIRE(rpe.size() == 3);
  CHECK(rpe[1]["length_m"] == 100.0);
  CHECK(rpe[1]["translation_mean_percent"].get<double>() == Approx(2.0).epsilon(0.01));
  CHECK(rpe[1]["pairs"] == 211);
  CHECK(json["rpe_by_path"]["keyframes"][1]["rotation_rms_deg"].get<double>() < 1e-9);

  // No pair is 1000 m apart: there is no number, and 0 would be one.
  CHECK(rpe[2]["pairs"] == 0);
  for (const char* key : {"translation_rms_m", "translation_mean_percent", "rotation_rms_deg",
                          "rotation_mean_deg_per_m"}) {
    CHECK(rpe[0][key].is_number());
    CHECK(rpe[2][key].is_null());
  }

  // The first pose states no covariance.
  CHECK(json["nees"]["live"]["poses"] == 300);
  double sum = 0.0;
  for (int i = 1; i <= 300; ++i) {
    const SE2 error = SE2(1.02 * i, 0.0, 0.1 * kDegree).inverse() * SE2(i, 0.0, 0.0);
    sum += error.Log().squaredNorm() / 0.04;
  }
  CHECK(json["nees"]["live"]["mean"].get<double>() == Approx(sum / 300.0));
  CHECK(json["nees"]["keyframes"]["median"].get<double>() == Approx(1.0));
  CHECK(json["nees"]["keyframes"]["share_above_95_band"] == 0.0);
}

TEST_CASE("NEES has its expected mean beside a truth whose standard deviations are given",
          "[cli]") {
  const geometry::TruthSigma sigma{0.08, 0.002};
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  const auto drawn = [&](double position_m, double heading_rad) {
    const Eigen::Vector3d error(position_m * normal(random), position_m * normal(random),
                                heading_rad * normal(random));
    return SE2::Exp(error);
  };

  // An estimate with errors of 2 cm and 1 mrad, on a way that turns.
  constexpr double kSigma_m = 0.02;
  constexpr double kSigma_rad = 0.001;
  const Eigen::Matrix3d covariance =
      Eigen::Vector3d(kSigma_m, kSigma_m, kSigma_rad).array().square().matrix().asDiagonal();
  double given = 0.0;
  double as_exact = 0.0;
  constexpr int kRuns = 300;
  for (int k = 0; k < kRuns; ++k) {
    MadeUpRun run;
    for (int i = 0; i <= 10; ++i) {
      const SE2 map_T_vehicle(20.0 * i, 0.5 * i * i, 0.05 * i);
      run.truth(i, kWorld_T_map * map_T_vehicle * drawn(sigma.position_m, sigma.heading_rad));
      if (i == 0) run.update(i, {}, model::MapUpdateStatus::kFirstMap);
      if (i > 0) run.pose(i, map_T_vehicle * drawn(kSigma_m, kSigma_rad), covariance);
    }
    given += cli::accuracy_summary(*run.accuracy(sigma))["nees"]["live"]["mean"].get<double>();
    as_exact += cli::accuracy_summary(*run.accuracy())["nees"]["live"]["mean"].get<double>();
  }
  CHECK(given / kRuns == Approx(3.0).margin(0.3));
  CHECK(as_exact / kRuns > 20.0);
}

TEST_CASE("NEES of keyframes leaves out those whose covariance is a submap's", "[cli]") {
  auto run = straight_run();
  model::Submap submap;
  submap.utime = MadeUpRun::at(32.0);
  submap.id = 1;
  for (std::uint64_t i = 0; i < 10; ++i) {
    submap.keyframes.push_back({i, MadeUpRun::at(static_cast<double>(i)),
                                SE2(10.0 * static_cast<double>(i), 0.0, 0.0),
                                1e-6 * Eigen::Matrix3d::Identity()});
  }
  submap.content_hash = model::fnv1a(submap.payload);
  run.send(32.0, "SUBMAP", submap);
  const auto json = cli::accuracy_summary(*run.accuracy());
  CHECK(json["keyframes"] == 31);
  CHECK(json["nees"]["keyframes"]["poses"] == 21);
}

TEST_CASE("Poses, keyframes and jumps of a run are counted by what they are", "[cli]") {
  auto run = straight_run();
  const Eigen::Matrix3d none = Eigen::Matrix3d::Zero();
  using enum model::MapUpdateStatus;
  run.pose(40.0, {}, none, [](auto& pose) { status(pose, kNotSure); });
  run.pose(40.1, {}, none, [](auto& pose) {
    status(pose, kNotSure);
    pose.is_lost = true;
    pose.reset_counter = 3;
  });
  run.pose(40.2, {}, none, [](auto& pose) { pose.is_coasting = true; });
  run.pose(40.3, {}, none, [](auto& pose) {
    status(pose, kUpdated);
    pose.reset_counter = 5;
  });
  run.update(40.0, {}, kNotSure);
  run.update(40.1, {}, kRolledBack);
  run.update(40.3, {});

  const auto counts = cli::accuracy_summary(*run.accuracy())["counts"];
  CHECK(counts["poses_by_status"] ==
        nlohmann::ordered_json::parse(R"({"coasting":1,"lost":1,"not_sure":1,)"
                                      R"("tracked":301,"updated":1})"));
  CHECK(counts["keyframes_without_pose"] == 2);
  // 0, 3, 0 of a mapper begun anew, 5.
  CHECK(counts["reset_counter_steps"] == 8);
}

TEST_CASE("Closures count once, by their last answer", "[cli]") {
  auto run = straight_run();
  const auto close = [&](double seconds, std::uint64_t id, bool is_revoked) {
    model::LoopClosure closure;
    closure.utime = MadeUpRun::at(seconds);
    closure.id = id;
    closure.source = "test";
    closure.is_revoked = is_revoked;
    closure.from.keyframe = 1;
    closure.to.keyframe = 2;
    closure.from_T_to.covariance = Eigen::Matrix3d::Identity();
    run.send(seconds, "LOOP_CLOSURE", closure);
  };
  const auto answer = [&](double seconds, std::uint64_t id, model::LoopResult::Status status,
                          const std::string& reason) {
    model::LoopResult result;
    result.utime = MadeUpRun::at(seconds);
    result.closure_id = id;
    result.status = status;
    result.reason = reason;
    run.send(seconds, "LOOP_RESULT", result);
  };

  using enum model::LoopResult::Status;
  for (std::uint64_t id = 1; id <= 6; ++id) close(40.0, id, false);
  close(41.0, 2, false);
  close(42.0, 6, true);
  answer(40.5, 1, kWaiting, "others must agree with it");
  answer(43.0, 1, kAccepted, "");
  answer(40.5, 2, kRefused, "both ends are in one part of the path");
  answer(40.5, 3, kRefused, "both ends are in one part of the path");
  answer(40.5, 4, kRefused, "the rest of the graph contradicts it");
  answer(42.5, 6, kRevoked, "");
  const auto closures = cli::accuracy_summary(*run.accuracy())["counts"]["closures"];
  CHECK(closures ==
        nlohmann::ordered_json::parse(
            R"({"sent":6,"accepted":1,"waiting":0,"revoked":1,"refused":3,"refused_by_reason":{)"
            R"("both ends are in one part of the path":2,)"
            R"("the rest of the graph contradicts it":1}})"));
}

TEST_CASE("Landmarks at one true landmark are doubles, pair by pair", "[cli]") {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> area(0.0, 60.0);
  std::normal_distribution<double> near_m(0.0, 0.3);
  for (int round = 0; round < 20; ++round) {
    std::vector<Eigen::Vector2d> trees;
    trees.reserve(40);
    std::vector<Eigen::Vector2d> landmarks;
    landmarks.reserve(90);
    for (int i = 0; i < 40; ++i) trees.emplace_back(area(random), area(random));
    for (int i = 0; i < 90; ++i) {
      const auto& tree = trees[static_cast<std::size_t>(i) % trees.size()];
      landmarks.emplace_back(tree.x() + near_m(random), tree.y() + near_m(random));
    }

    const auto nearest = [&](const Eigen::Vector2d& point) {
      return std::ranges::min_element(trees, {}, [&](const auto& t) { return (t - point).norm(); });
    };
    std::uint64_t pairs = 0;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      for (std::size_t j = i + 1; j < landmarks.size(); ++j) {
        const auto tree = nearest(landmarks[i]);
        if (tree == nearest(landmarks[j]) && (landmarks[i] - *tree).norm() <= 0.5 &&
            (landmarks[j] - *tree).norm() <= 0.5)
          ++pairs;
      }
    }
    CHECK(cli::compare_landmarks(landmarks, std::vector<bool>(90, true), trees).double_pairs ==
          pairs);
  }
  CHECK(cli::accuracy_summary(*straight_run().accuracy())["doubles"].is_null());
}

TEST_CASE("Bytes of channels leave out sensors and truth", "[cli]") {
  auto run = straight_run();
  wheels_t wheels{};
  run.send(1.0, "RAW_WHEELS", wheels);
  run.send(1.0, "RAW_POSE", wheels);
  const auto channels = cli::accuracy_summary(*run.accuracy())["bytes_by_channel"];
  REQUIRE(channels.size() == 4);
  CHECK(channels[0]["channel"] == "SLAM_POSE");
  std::uint64_t last = channels[0]["bytes"];
  for (const auto& one : channels) {
    CHECK(one["bytes"].get<std::uint64_t>() <= last);
    last = one["bytes"];
    CHECK(one["channel"] != "RAW_WHEELS");
    CHECK(one["channel"] != "GROUND_TRUTH");
  }
}
