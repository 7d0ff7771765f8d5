// What few landmarks are worth beside odometry.
#include "services/geoslam_mapper/smoothing/few_matches.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/inertial_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kReach_m = 30.0;
constexpr double kPoint_m = 0.05;
const Eigen::Vector3d kGuess(0.1, 0.06, 0.01);  // Standard deviations.

/// A scan of a few landmarks among `around` others, from a pose that odometry knows as kGuess says.
class FewLandmarks {
 public:
  explicit FewLandmarks(std::uint64_t seed) : random_(seed) {}

  MatchedScan scan(int seen, int false_ones, int around, double guess_scale = 1.0) {
    reference_.clear();
    observed_.clear();
    const geometry::SE2 truth(draw(), draw(), draw());
    for (int i = 0; i < seen; ++i) {
      const Eigen::Vector2d at = place();
      observed_.push_back({at + kPoint_m * Eigen::Vector2d(draw(), draw()), square(kPoint_m)});
      reference_.push_back(
          {truth * at + kPoint_m * Eigen::Vector2d(draw(), draw()), square(kPoint_m)});
    }
    for (int i = 0; i < around; ++i) reference_.push_back({truth * place(), square(kPoint_m)});
    for (int i = 0; i < false_ones; ++i) observed_.push_back({place(), square(kPoint_m)});

    const Eigen::Vector3d sigma = guess_scale * kGuess;
    const geometry::SE2WithCovariance guess{
        truth * geometry::SE2::Exp(sigma.cwiseProduct(Eigen::Vector3d(draw(), draw(), draw()))),
        sigma.cwiseAbs2().asDiagonal()};
    return {reference_, observed_, guess, register_points(reference_, observed_, guess)};
  }

 private:
  static double square(double x) { return x * x; }
  double draw() { return normal_(random_); }
  Eigen::Vector2d place() {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const double range = kReach_m * std::sqrt(unit(random_));
    const double bearing = 2.0 * std::numbers::pi * unit(random_);
    return range * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<geometry::UncertainPoint> reference_;
  std::vector<geometry::UncertainPoint> observed_;
};

}  // namespace

TEST_CASE("One landmark, and two, add to odometry", "[few_matches]") {
  for (const int seen : {1, 2, 3}) {
    FewLandmarks world(static_cast<std::uint64_t>(seen));
    int taken = 0;
    constexpr int kScans = 2000;
    for (int i = 0; i < kScans; ++i) {
      const MatchedScan scan = world.scan(seen, 0, 2);
      if (adds_to_odometry(scan, {}, kReach_m)) ++taken;
    }
    CHECK(taken > kScans * 95 / 100);
  }
}

TEST_CASE("A pair by chance adds nothing", "[few_matches]") {
  // Where odometry is known to a metre a gate takes in what has nothing to do with it.
  for (const double scale : {1.0, 3.0, 10.0}) {
    FewLandmarks world(7);
    int taken = 0;
    constexpr int kScans = 4000;
    for (int i = 0; i < kScans; ++i) {
      if (adds_to_odometry(world.scan(0, 1, 10, scale), {}, kReach_m)) ++taken;
    }
    INFO("guess times " << scale);
    CHECK(taken <= kScans / 100);
  }
}

TEST_CASE("A pair that contradicts odometry adds nothing", "[few_matches]") {
  const std::vector<geometry::UncertainPoint> reference{{{3.0, 0.0}, kPoint_m * kPoint_m}};
  const std::vector<geometry::UncertainPoint> observed{{{3.0, 0.0}, kPoint_m * kPoint_m}};
  const auto adds = [&](const geometry::SE2& off) {
    const geometry::SE2WithCovariance guess{off, Eigen::Vector3d(1e-2, 3.6e-3, 1e-6).asDiagonal()};
    const MatchedScan scan{reference, observed, guess, register_points(reference, observed, guess)};
    REQUIRE(count_clear(scan.found.pairs) == 1);  // The gate is round.
    return adds_to_odometry(scan, {}, kReach_m);
  };
  CHECK(adds({0.3, 0.0, 0.0}));        // 2.4 standard deviations ahead.
  CHECK_FALSE(adds({0.0, 0.4, 0.0}));  // 4.3 to the side.
}

namespace {

/// Live poses of a drive with so many landmarks in a scan, and wheels.
struct LivePoses {
  int scans = 0;
  int located = 0;
  int coasting = 0;
  double landmarks = 0.0;
  double squared_m2 = 0.0;  ///< Of the position's error, first pose held.
  double nees = 0.0;
};

LivePoses drive_among_few(double spacing_m, double clutter_share, std::uint64_t seed) {
  sim::ForestParameters forest;
  forest.side_m = 300.0;
  forest.min_distance_m = spacing_m;
  forest.tile_reach = 2;
  const sim::TrunkField field = sim::make_trunk_field(forest, seed);
  sim::InertialDriveParameters parameters;
  parameters.stationary_s = 1.0;
  parameters.speed_mps = 2.0;
  parameters.loop_length_m = 150.0;
  parameters.wiggle_curvature = 0.0;
  parameters.scan_interval_s = 0.2;
  parameters.range_m = 20.0;
  parameters.position_sigma_m = 0.05;
  parameters.wheel_sigma_m = 0.02;
  parameters.wheel_sigma_rad = 0.01;
  parameters.clutter_share = clutter_share;
  parameters.odometry = sim::OdometryKind::kWheels;
  sim::InertialDrive drive(parameters, field, seed);

  keyframer::joint::JointKeyframer keyframer{keyframer::JointKeyframerParameters{}};
  SmoothingMapperParameters mapping;
  mapping.use_odometry = true;
  SmoothingMapper mapper(mapping);
  LivePoses result;
  std::optional<geometry::SE2> map_T_world;
  for (int k = 0; k < 400; ++k) {
    const sim::DriveStep step = drive.next();
    for (const model::Odometry& increment : step.odometry) {
      keyframer.add(increment);
      mapper.add(increment);
    }
    result.landmarks += static_cast<double>(step.scan.detections.size()) / 400.0;
    ++result.scans;
    const auto found = mapper.locate(step.scan);
    if (const auto keyframe = keyframer.add(step.scan)) mapper.add(*keyframe);
    if (!found) continue;

    if (!map_T_world) map_T_world = found->map_T_vehicle.mean * step.world_T_vehicle.inverse();
    const geometry::SE2 truth = *map_T_world * step.world_T_vehicle;
    const Eigen::Vector3d error = (found->map_T_vehicle.mean.inverse() * truth).Log();
    ++result.located;
    if (found->is_coasting) ++result.coasting;
    result.squared_m2 += error.head<2>().squaredNorm();
    result.nees += error.dot(
        (found->map_T_vehicle.covariance + 1e-8 * Eigen::Matrix3d::Identity()).llt().solve(error));
  }
  return result;
}

}  // namespace

TEST_CASE("Two landmarks in a scan hold the live pose", "[few_matches]") {
  double nees = 0.0;
  double rms_m = 0.0;
  constexpr int kDrives = 6;
  for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
    const LivePoses poses = drive_among_few(25.0, 0.0, seed);
    INFO("seed " << seed << ", " << poses.landmarks << " landmarks in a scan, " << poses.coasting
                 << " of " << poses.located << " coasting");
    REQUIRE(poses.landmarks > 0.8);
    REQUIRE(poses.landmarks < 3.5);
    CHECK(poses.located > poses.scans - 20);
    CHECK(2 * poses.coasting < poses.located);
    nees += poses.nees / poses.located / kDrives;
    rms_m += std::sqrt(poses.squared_m2 / poses.located) / kDrives;
  }
  CAPTURE(nees, rms_m);
  CHECK(nees < 6.0);
  CHECK(rms_m < 1.5);
}

TEST_CASE("False detections do not take the live pose along", "[few_matches]") {
  double nees = 0.0;
  constexpr int kDrives = 6;
  for (std::uint64_t seed = 11; seed < 11 + kDrives; ++seed) {
    const LivePoses poses = drive_among_few(25.0, 0.3, seed);
    nees += poses.nees / poses.located / kDrives;
  }
  CHECK(nees < 8.0);
}
