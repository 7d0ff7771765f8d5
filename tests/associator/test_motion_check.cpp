// Who walks is no landmark; a stationary trunk is one, however alone.
#include <cmath>
#include <random>

#include "services/associator/associator.hpp"
#include "services/associator/motion_check.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::associator;

namespace {

constexpr double kSpeed_mps = 8.0;
constexpr double kSigma_m = 0.03;
constexpr double kPeriod_s = 0.1;

struct Thing {
  Eigen::Vector2d position_m;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();
};

/// Drives straight on past the things. Gives how many of the scans published each.
std::vector<int> times_published(const std::vector<Thing>& things, double walking_mps,
                                 std::uint64_t seed, int scans = 25) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  AssociatorParameters parameters;
  parameters.walking_mps = walking_mps;
  Associator associator(parameters);
  std::vector<int> published(things.size(), 0);
  const auto stamp = [](int k) { return 1'000'000 + static_cast<model::Utime>(k) * 100'000; };
  for (int k = 0; k < scans; ++k) {
    if (k > 0) {
      model::Odometry increment;
      increment.from_utime = stamp(k - 1);
      increment.utime = stamp(k);
      increment.from_T_to = geometry::SE2(kSpeed_mps * kPeriod_s + 1e-3 * normal(random), 0.0, 0.0);
      // As wheels report it that count their correlated error as noise.
      increment.covariance = Eigen::Vector3d(1.4e-3, 1.2e-3, 2e-7).asDiagonal();
      increment.has_wheels = true;
      increment.inertial.emplace();
      associator.add(increment);
    }
    model::LandmarkScan scan;
    scan.utime = stamp(k);
    scan.field_of_view.max_range_m = 60.0;
    const double time_s = kPeriod_s * k;
    for (const Thing& thing : things) {
      model::Detection& detection = scan.detections.emplace_back();
      detection.position_m.head<2>() = thing.position_m + time_s * thing.velocity_mps +
                                       kSigma_m * Eigen::Vector2d(normal(random), normal(random));
      detection.position_m.x() -= kSpeed_mps * time_s;
      detection.covariance_m2 = kSigma_m * kSigma_m * Eigen::Matrix3d::Identity();
    }
    const model::TrackedScan tracked = *associator.add(scan);
    for (const model::TrackedLandmark& landmark : tracked.landmarks)
      ++published[landmark.detection];
  }
  return published;
}

/// A track that was first observed at (20, 5), with these variances.
Track track_with(double x_variance_m2, double y_variance_m2) {
  Track track;
  track.reference.position_m << 20.0, 5.0;
  track.reference.covariance_m2.diagonal() << x_variance_m2, y_variance_m2;
  return track;
}

/// An observation of it 0.1 s later, so far off; the vehicle has turned by `turn_rad`.
void observe_again(Track& track, const Eigen::Vector2d& off_m, double turn_rad = 0.0) {
  const MotionCheck check{0.1, {geometry::SE2(0.0, 0.0, turn_rad), Eigen::Matrix3d::Zero()}};
  Observation observation;
  observation.position_m = check.then_T_now.mean.inverse() * track.reference.position_m + off_m;
  observation.covariance_m2.setZero();
  check_motion(track, observation, check, {});
}

}  // namespace

TEST_CASE("A contradiction is beyond chi^2 of 23, by the uncertainty along it",
          "[associator][motion]") {
  // With the floor of 0.03 m per axis.
  const double x_variance_m2 = 0.0391 + 9e-4;
  const double y_variance_m2 = 0.0001 + 9e-4;
  for (const double chi2 : {22.9, 23.1}) {
    const bool is_off = chi2 > 23.0;
    for (const double turn_rad : {0.0, 0.5 * 3.14159265358979}) {
      Track track = track_with(0.0391, 0.0001);
      const double x_off_m = std::sqrt(chi2 * (turn_rad == 0.0 ? x_variance_m2 : y_variance_m2));
      const double y_off_m = std::sqrt(chi2 * (turn_rad == 0.0 ? y_variance_m2 : x_variance_m2));
      observe_again(track, {x_off_m, 0.0}, turn_rad);
      CHECK(track.moved_in_a_row == (is_off ? 1 : 0));
      observe_again(track, {0.0, -y_off_m}, turn_rad);
      CHECK(track.moved_in_a_row == (is_off ? 2 : 0));
      CHECK(track.steadiness == (is_off ? Steadiness::kMoves : Steadiness::kUnknown));
    }
  }
}

TEST_CASE("Only contradictions in a row mean that a track moves", "[associator][motion]") {
  Track track = track_with(0.01, 0.01);
  for (int k = 0; k < 3; ++k) {
    observe_again(track, {2.0, 0.0});
    CHECK(track.steadiness == Steadiness::kUnknown);
    observe_again(track, {0.0, 0.0});
  }
  observe_again(track, {2.0, 0.0});
  observe_again(track, {2.0, 0.0});
  CHECK(track.steadiness == Steadiness::kMoves);
}

TEST_CASE("Somebody who walks, alone in view, is not published", "[associator][motion]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> angle(-3.14, 3.14);
    const double heading = angle(random);
    const Thing walker{{25.0, 6.0}, 1.3 * Eigen::Vector2d(std::cos(heading), std::sin(heading))};
    REQUIRE(times_published({walker}, 0.8, seed).front() == 0);
  }
  // Without the check it would be.
  const Thing walker{{25.0, 6.0}, {1.3, 0.0}};
  REQUIRE(times_published({walker}, 0.0, 1).front() > 0);
}

TEST_CASE("A stationary trunk is published, however alone", "[associator][motion]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    REQUIRE(times_published({{{25.0, 6.0}}}, 0.8, seed).front() >= 17);
  }
}

TEST_CASE("Somebody who walks among trunks is left out, and they are not", "[associator][motion]") {
  std::vector<Thing> things{{{25.0, 3.0}, {0.0, 1.3}}};
  for (int k = 0; k < 6; ++k) things.push_back({{6.0 * k, k % 2 == 0 ? -9.0 : 12.0}});
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const std::vector<int> published = times_published(things, 0.8, seed);
    REQUIRE(published.front() == 0);
    for (std::size_t k = 1; k < things.size(); ++k) REQUIRE(published[k] >= 17);
  }
}
