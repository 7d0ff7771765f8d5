// A drive put together again from the factors of its stretches is the drive uncut.
#include "services/geoslam_mapper/smoothing/expansion.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kStep_m = 1.6;
constexpr double kRange_m = 25.0;
constexpr double kSigma_m = 0.07;
constexpr int kKeyframes = 150;

/// What a drive in a bend gave.
struct Driven {
  SmoothingMapperParameters parameters;
  std::unique_ptr<SmoothingMapper> mapper;
  std::vector<Stretch> stretches;
  LandmarkAliases aliases;

  /// All of it as one graph, at its optimum.
  ExpandedDrive settled() const {
    std::vector<Stretch> all = stretches;
    all.push_back(mapper->current().rest());
    std::vector<PlacedStretch> placed;
    for (const Stretch& one : all) {
      const auto& graph = mapper->current().map().graph;
      placed.push_back({&one, one.node ? graph.pose(*one.node) : geometry::SE2()});
    }
    ExpandedDrive drive = expand(placed, aliases, parameters);
    REQUIRE(settle(drive, parameters));
    return drive;
  }
};

/// Landmarks everywhere, odometry whose heading is poor. The same seed gives the same measurements.
Driven drive(double condense_m, std::uint64_t seed, double sparse = 0.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> place(-60.0, 260.0);
  std::vector<Eigen::Vector2d> trunks;
  for (int i = 0; i < 1200; ++i) trunks.emplace_back(place(random), place(random) - 30.0);

  Driven result;
  result.parameters.use_odometry = true;
  result.parameters.gyro_walk = 0.0;
  result.parameters.start_wait_s = 0.0;
  result.parameters.condense_m = condense_m;
  result.parameters.condense_of_range = 100.0;
  result.parameters.cut_sparse = sparse;
  result.mapper = std::make_unique<SmoothingMapper>(result.parameters);
  result.mapper->keep_stretches();
  const geometry::SE2 motion(kStep_m, 0.0, 0.008);
  geometry::SE2 truth;
  for (int k = 0; k < kKeyframes; ++k) {
    const model::Utime utime = 800'000 * (k + 1);
    if (k > 0) {
      const Eigen::Vector3d sigma(0.016, 0.003, 0.002);
      const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
      model::Odometry odometry;
      odometry.from_utime = utime - 800'000;
      odometry.utime = utime;
      odometry.sequence = static_cast<std::uint64_t>(k);
      odometry.from_T_to = motion * geometry::SE2::Exp(sigma.cwiseProduct(noise));
      odometry.covariance = sigma.cwiseAbs2().asDiagonal();
      odometry.has_wheels = true;
      result.mapper->add(odometry);
      truth = truth * motion;
    }

    model::Keyframe keyframe;
    keyframe.utime = utime;
    keyframe.sequence = static_cast<std::uint64_t>(k + 1);
    keyframe.field_of_view.max_range_m = kRange_m;
    keyframe.members.push_back({utime, keyframe.sequence, {}, 1e-10 * Eigen::Matrix3d::Identity()});
    for (const Eigen::Vector2d& trunk : trunks) {
      const Eigen::Vector2d local = truth.inverse() * trunk;
      const Eigen::Vector2d noise(normal(random), normal(random));
      if (local.norm() > kRange_m || local.norm() < 1.5) continue;
      model::KeyframeLandmark& one = keyframe.landmarks.emplace_back();
      one.position_m = local + kSigma_m * noise;
      one.covariance_m2 = kSigma_m * kSigma_m * Eigen::Matrix2d::Identity();
      one.radius_m = 0.15;
      one.observation_count = 8;
    }
    const model::MapUpdate update = result.mapper->add(keyframe);
    result.aliases.add(update.merged);
    for (Stretch& one : result.mapper->take_stretches()) result.stretches.push_back(std::move(one));
  }
  return result;
}

/// RMS distance of keyframes of the same time [m]; all of `a` must be in `b`.
template <class A, class B>
double rmse_m(const A& a, const B& b) {
  std::map<model::Utime, geometry::SE2> other;
  for (const model::KeyframePose& one : b) other[one.utime] = one.map_T_vehicle;
  double sum = 0.0;
  for (const model::KeyframePose& one : a) {
    REQUIRE(other.contains(one.utime));
    sum += (other.at(one.utime).translation() - one.map_T_vehicle.translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(a.size()));
}

}  // namespace

TEST_CASE("A drive put together from its stretches is the drive uncut", "[mapper]") {
  for (const std::uint64_t seed : {1U, 2U}) {
    const Driven uncut = drive(0.0, seed);
    CHECK(uncut.stretches.empty());
    const auto whole = uncut.settled().trajectory();
    CHECK(whole.size() == kKeyframes);
    // As the mapper has it, but for what is left of its linearisations.
    CHECK(rmse_m(uncut.mapper->trajectory(), whole) < 0.01);

    for (const double size_m : {10.0, 60.0}) {
      const Driven cut = drive(size_m, seed);
      CHECK(cut.stretches.size() > 1);
      CHECK(rmse_m(cut.settled().trajectory(), whole) < 2e-3);
    }
  }
}

TEST_CASE("No factor of a drive is in two stretches, and none is lost", "[mapper]") {
  const Driven uncut = drive(0.0, 3);
  const Driven cut = drive(20.0, 3);
  const auto whole = uncut.settled().graph;
  const auto together = cut.settled().graph;
  CHECK(together.poses.size() == whole.poses.size());
  CHECK(together.relative_poses.size() == whole.relative_poses.size());
  // Associations may differ here and there.
  const double observed = static_cast<double>(whole.observations.size());
  CHECK(std::abs(static_cast<double>(together.observations.size()) - observed) < 0.001 * observed);

  std::map<std::pair<std::uint32_t, std::uint32_t>, int> times;
  for (const auto& one : together.relative_poses) {
    const auto [entry, is_new] = times.try_emplace({index(one.a), index(one.b)}, 0);
    ++entry->second;
  }
  for (const auto& [ends, count] : times) CHECK(count == 1);
}

TEST_CASE("Stretches are as their policy says, and come back from their bytes", "[mapper]") {
  const Driven distance = drive(20.0, 4);
  const Driven sparse = drive(20.0, 4, 30.0);
  CHECK(sparse.stretches.size() < distance.stretches.size());

  constexpr state::Format kFormat{"test.stretch", 1};
  const Stretch& one = distance.stretches.front();
  const std::string bytes = state::save(kFormat, one);
  Stretch read;
  state::load(bytes, kFormat, read);
  CHECK(state::save(kFormat, read) == bytes);
  CHECK(read.observations.size() == one.observations.size());
}

TEST_CASE("A merge that is merged again, and one that comes back", "[mapper]") {
  LandmarkAliases aliases;
  using Pairs = std::vector<std::pair<model::LandmarkId, model::LandmarkId>>;
  aliases.add(Pairs{{1, 2}});
  aliases.add(Pairs{{2, 3}, {7, 3}});
  CHECK(aliases(1) == 3);
  CHECK(aliases(7) == 3);
  CHECK(aliases(4) == 4);
  aliases.add(Pairs{{3, 1}});  // 1 is there again.
  CHECK(aliases(3) == 1);
  CHECK(aliases(1) == 1);
}
