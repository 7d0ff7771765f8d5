// The thesis's way to partition a map (thesis on submaps §2.3.3, §3.4), on drives made here.
#include <cmath>
#include <filesystem>
#include <random>
#include <set>
#include <utility>

#include "common/factor_graph/plane/optimise.hpp"
#include "eval/experiments/partition/baseline_submap.hpp"
#include "eval/experiments/partition/policies.hpp"
#include "eval/experiments/partition/recorded_drive.hpp"
#include "eval/experiments/partition/scoring.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments::partition;
namespace plane = understory::factor_graph::plane;

namespace {

constexpr std::size_t kPoses = 120;
constexpr double kStep_m = 1.6;

/// A drive in a bend among landmarks, not yet optimised.
DriveGraph made_drive(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> place(-40.0, 230.0);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  DriveGraph drive;
  std::vector<geometry::SE2> truth{{}};
  for (std::size_t i = 1; i < kPoses; ++i)
    truth.push_back(truth.back() * geometry::SE2(kStep_m, 0.0, 0.01));
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 700; ++i) points.emplace_back(place(random), place(random));

  const Eigen::Vector3d sigma(0.016, 0.003, 0.003);
  geometry::SE2 pose;
  for (std::size_t i = 0; i < kPoses; ++i) {
    const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
    if (i > 0) {
      const geometry::SE2 motion =
          truth[i - 1].inverse() * truth[i] * geometry::SE2::Exp(sigma.cwiseProduct(noise));
      const auto number = static_cast<std::uint32_t>(i);
      drive.graph.relative_poses.push_back({plane::PoseId(number - 1), plane::PoseId(number),
                                            motion, sigma.cwiseAbs2().cwiseInverse().asDiagonal()});
      pose = pose * motion;
    }
    const plane::PoseId id = drive.graph.add_pose(pose);
    drive.keyframes.push_back({i + 1, static_cast<model::Utime>(i + 1) * 100'000, id, {}});
    drive.scans_of_pose.push_back(1);
    drive.stretch_of_pose.push_back(0);
  }
  for (const Eigen::Vector2d& point : points) drive.graph.add_point(point);
  const Eigen::Matrix2d information = Eigen::Matrix2d::Identity() / (0.07 * 0.07);
  for (std::uint32_t i = 0; i < kPoses; ++i) {
    for (std::uint32_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector2d local = truth[i].inverse() * points[k];
      const Eigen::Vector2d noise(normal(random), normal(random));
      if (local.norm() > 25.0 || chance(random) > 0.8) continue;
      drive.graph.observations.push_back(
          {plane::PoseId(i), plane::PointId(k), local + 0.07 * noise, information});
    }
  }
  drive.graph.pose_priors.push_back({plane::PoseId(0), {}, 1e10 * Eigen::Matrix3d::Identity()});
  return drive;
}

DriveGraph optimised(DriveGraph drive) {
  REQUIRE(plane::optimise(drive.graph).ok);
  return drive;
}

double rms_m(const std::vector<geometry::SE2>& a, const std::vector<geometry::SE2>& b) {
  REQUIRE(a.size() == b.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (a[i].translation() - b[i].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

BaselineOptions options_of(double size_m) {
  BaselineOptions options;
  options.policy = Policy{"distance", size_m, size_m}.cuts();
  options.also_full = true;
  return options;
}

}  // namespace

TEST_CASE("Submaps have each factor of the drive once, and share what the thesis says",
          "[partition]") {
  const DriveGraph drive = optimised(made_drive(1));
  const std::vector<std::size_t> cuts = cuts_of(drive, options_of(40.0).policy);
  REQUIRE(cuts.size() == 4);
  const std::vector<BaselineSubmap> submaps = submaps_of(drive, cuts, Shared::kAtCut);
  std::size_t observations = 0;
  std::size_t motions = 0;
  for (const BaselineSubmap& one : submaps) {
    observations += one.graph.observations.size();
    motions += one.graph.relative_poses.size();
    CHECK(one.origin() > 0);
    CHECK(one.origin() < one.last - one.first);
  }
  CHECK(observations == drive.graph.observations.size());
  CHECK(motions == kPoses - 1);

  // By the definition: seen from the cut pose and from the next one.
  std::set<std::uint32_t> at;
  std::set<std::uint32_t> both;
  for (const auto& one : drive.graph.observations)
    if (index(one.pose) == cuts[0]) at.insert(index(one.point));
  for (const auto& one : drive.graph.observations)
    if (index(one.pose) == cuts[0] + 1 && at.contains(index(one.point)))
      both.insert(index(one.point));
  std::set<std::uint32_t> shared;
  for (const std::size_t own : submaps[0].shared_points)
    shared.insert(index(submaps[0].points[own]));
  CHECK(shared == both);
  CHECK(submaps_of(drive, cuts, Shared::kAll)[0].shared_points.size() > both.size());
}

TEST_CASE("A drive that is not cut is the batch solution", "[partition]") {
  const DriveGraph drive = optimised(made_drive(2));
  const BaselineSolution solution = solve_by_submaps(drive, options_of(1000.0));
  CHECK(solution.cuts.empty());
  CHECK(rms_m(solution.chained, drive.graph.poses) < 1e-4);
  CHECK(rms_m(solution.expanded, drive.graph.poses) < 1e-3);
}

TEST_CASE("Full optimisation after expansion ends at the batch solution", "[partition]") {
  for (const std::uint64_t seed : {3U, 4U}) {
    const DriveGraph drive = optimised(made_drive(seed));
    for (const double size_m : {20.0, 60.0}) {
      const BaselineSolution solution = solve_by_submaps(drive, options_of(size_m));
      CHECK(rms_m(solution.full, drive.graph.poses) < 1e-3);
      CHECK(rms_m(solution.expanded, drive.graph.poses) > 1e-3);
    }
  }
}

TEST_CASE("The joint covariance of all that is shared keeps what submaps know", "[partition]") {
  double singly_m = 0.0;
  double jointly_m = 0.0;
  for (const std::uint64_t seed : {5U, 6U, 7U}) {
    const DriveGraph drive = optimised(made_drive(seed));
    BaselineOptions options = options_of(40.0);
    options.also_full = false;
    singly_m += rms_m(solve_by_submaps(drive, options).expanded, drive.graph.poses);
    options.condensed = Condensed::kJointly;
    options.shared = Shared::kAll;
    jointly_m += rms_m(solve_by_submaps(drive, options).expanded, drive.graph.poses);
  }
  CHECK(jointly_m < 0.5 * singly_m);
}

TEST_CASE("A manual closure is kept by the condensed graph and its expansion", "[partition]") {
  const DriveGraph drive = optimised(made_drive(8));
  BaselineOptions options = options_of(40.0);
  options.first_T_last = drive.graph.poses.front().inverse() * drive.graph.poses.back() *
                         geometry::SE2(0.3, -0.2, 0.01);
  const BaselineSolution solution = solve_by_submaps(drive, options);
  const geometry::SE2 got = solution.expanded.front().inverse() * solution.expanded.back();
  CHECK((got.translation() - options.first_T_last->translation()).norm() < 0.01);
  CHECK(rms_m(solution.expanded, drive.graph.poses) > 0.01);
}

TEST_CASE("A submap that is not determined is named", "[partition]") {
  DriveGraph drive = made_drive(9);
  std::erase_if(drive.graph.relative_poses,
                [](const auto& one) { return index(one.a) == 70 || index(one.b) == 70; });
  // One landmark fixes two of its three degrees of freedom.
  bool is_first = true;
  std::erase_if(drive.graph.observations, [&](const auto& one) {
    return index(one.pose) == 70 && !std::exchange(is_first, false);
  });
  CHECK_THROWS_WITH(solve_by_submaps(drive, options_of(1000.0)),
                    Catch::Contains("submap of poses 0 to 119"));
}

TEST_CASE("Distances at cuts and between them", "[partition]") {
  Trajectory a;
  Trajectory b;
  for (int i = 0; i < 10; ++i) {
    a.push_back({i, {static_cast<double>(i), 0.0, 0.0}});
    b.push_back({i, {static_cast<double>(i), i == 4 ? 3.0 : 1.0, 0.0}});
  }
  const std::vector<model::Utime> cuts{4};
  const Distances found = distances(a, b, cuts);
  CHECK(std::abs(found.at_cuts_m - 3.0) < 1e-12);
  CHECK(std::abs(found.between_m - 1.0) < 1e-12);
  CHECK(std::abs(found.all_m - std::sqrt(1.8)) < 1e-12);
}

TEST_CASE("The thesis's rows are found by route, policy and table", "[partition]") {
  CHECK(published("urban", {"distance", 200.0, 200.0}, false)->rmse_m == 0.2637);
  CHECK(published("urban", {"dense", 100.0, 6.0}, true)->mean_submap_m == 232.1);
  CHECK_FALSE(published("urban", {"distance", 20.0, 20.0}, false));
  CHECK_FALSE(published("countryside", {"distance", 200.0, 200.0}, false));
}

TEST_CASE("A recorded drive is the same after it was kept", "[partition]") {
  RouteParameters parameters;
  parameters.length_m = 60.0;
  Route route(parameters, 3);
  const RecordedDrive drive = record(route);
  const auto file = std::filesystem::temp_directory_path() / "understory_test_partition.lcm";
  save(drive, file);
  const RecordedDrive read = load(file);
  std::filesystem::remove(file);
  REQUIRE(read.inputs.size() == drive.inputs.size());
  REQUIRE(read.truth.size() == drive.truth.size());
  const auto& first = std::get<model::Keyframe>(drive.inputs.front());
  const auto& again = std::get<model::Keyframe>(read.inputs.front());
  REQUIRE(again.landmarks.size() == first.landmarks.size());
  CHECK((again.landmarks[0].position_m - first.landmarks[0].position_m).norm() < 1e-6);

  const RecordedDrive part = drive.first(30.0);
  CHECK(part.truth.size() < drive.truth.size());
  CHECK(part.length_m() <= 30.0);
  CHECK(drive.first(1e9).inputs.size() == drive.inputs.size());
}
