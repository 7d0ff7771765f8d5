// The scores of a recorded drive, on examples whose answers are known by hand.
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "eval/metrics/victoria_park_score.hpp"
#include "eval/tools/quantile.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;
using namespace understory::eval;
using test::TemporaryDirectory;

namespace {

double difference(const geometry::SE2& a, const geometry::SE2& b) {
  return (a.inverse() * b).Log().norm();
}

/// A drive on an arc: one pose a second.
std::vector<eval::metrics::StampedPose> arc(std::size_t poses) {
  std::vector<eval::metrics::StampedPose> trajectory;
  for (std::size_t i = 0; i < poses; ++i) {
    trajectory.push_back(
        {static_cast<model::Utime>(i) * 1000000,
         geometry::SE2::Exp(static_cast<double>(i) * Eigen::Vector3d(2, 0, 0.05))});
  }
  return trajectory;
}

model::GnssFix fix(model::Utime utime, const Eigen::Vector2d& east_north) {
  model::GnssFix one;
  one.utime = utime;
  one.east_north_m = east_north;
  return one;
}

model::MapLandmark landmark(model::LandmarkId id, double x, double y) {
  model::MapLandmark one;
  one.id = id;
  one.position_m = {x, y};
  return one;
}

/// `times` observations of a tree at a place of the map, one from each pose.
void observe(std::vector<eval::metrics::CuratedObservation>& observations,
             const std::vector<eval::metrics::StampedPose>& trajectory, int tree,
             const Eigen::Vector2d& place, std::size_t times) {
  for (std::size_t i = 0; i < times; ++i) {
    observations.push_back({trajectory[i].utime, trajectory[i].pose.inverse() * place, tree});
  }
}

}  // namespace

TEST_CASE("a quantile is the value below which that part lies", "[victoria_park]") {
  std::vector<double> values(101);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(100 - i);
  CHECK(eval::tools::quantile(values, 0.0) == 0.0);
  CHECK(eval::tools::quantile(values, 0.5) == 50.0);
  CHECK(eval::tools::quantile(values, 0.9) == 90.0);
  CHECK(eval::tools::quantile(values, 1.0) == 100.0);
  CHECK(eval::tools::quantile({}, 0.5) == 0.0);
}

TEST_CASE("between two poses the motion is even, outside there is none", "[victoria_park]") {
  const auto trajectory = arc(10);
  CHECK(difference(*eval::metrics::pose_at(trajectory, 3000000), trajectory[3].pose) == 0.0);
  CHECK(difference(*eval::metrics::pose_at(trajectory, 3500000),
                   geometry::SE2::Exp(3.5 * Eigen::Vector3d(2, 0, 0.05))) < 1e-12);
  CHECK_FALSE(eval::metrics::pose_at(trajectory, -1));
  CHECK_FALSE(eval::metrics::pose_at(trajectory, 9000001));
  CHECK_FALSE(eval::metrics::pose_at({}, 0));
}

TEST_CASE("dead reckoning fills the gaps and ends where the next pose is known",
          "[victoria_park]") {
  const auto reckoned = arc(21);
  // The truth turns a little more than the wheels say, and starts elsewhere.
  std::vector<eval::metrics::StampedPose> known;
  for (std::size_t i = 4; i <= 16; i += 4) {
    known.push_back({reckoned[i].utime, geometry::SE2(7.0, -3.0, 1.0) *
                                            geometry::SE2::Exp(static_cast<double>(i) *
                                                               Eigen::Vector3d(2.01, 0, 0.051))});
  }
  const auto filled = fill_between(known, reckoned);
  REQUIRE(filled.size() == 17);
  for (std::size_t i = 0; i < filled.size(); ++i) {
    const std::size_t at = i + 4;
    CHECK(filled[i].utime == reckoned[at].utime);
    const geometry::SE2 truth =
        geometry::SE2(7.0, -3.0, 1.0) *
        geometry::SE2::Exp(static_cast<double>(at) * Eigen::Vector3d(2.01, 0, 0.051));
    if (at <= 16) CHECK(difference(filled[i].pose, truth) < (at % 4 == 0 ? 1e-9 : 0.006));
  }
  // Behind the last known pose the wheels alone go on.
  const geometry::SE2 after = known.back().pose * (reckoned[16].pose.inverse() * reckoned[20].pose);
  CHECK(difference(filled.back().pose, after) < 1e-12);
}

TEST_CASE("fixes on the path, in another frame, have no error", "[victoria_park]") {
  const auto trajectory = arc(30);
  const geometry::SE2 world_T_map(100.0, -50.0, 2.0);
  std::vector<model::GnssFix> fixes;
  for (model::Utime t = 500000; t < 29000000; t += 1300000) {
    fixes.push_back(fix(t, (world_T_map * *eval::metrics::pose_at(trajectory, t)).translation()));
  }
  fixes.push_back(fix(40000000, {0.0, 0.0}));  // After the drive: left out.
  const eval::metrics::FixErrors errors = against_fixes(trajectory, fixes);
  CHECK(errors.at_time_m.size() == fixes.size() - 1);
  CHECK(difference(errors.world_T_map, world_T_map) < 1e-9);
  CHECK(errors.at_time_p90_m < 1e-9);
  CHECK(errors.to_path_p90_m < 0.013);  // Straight lines of 2 m on a radius of 40 m.
}

TEST_CASE("fixes are the antenna's, not the vehicle's", "[victoria_park]") {
  // Left and right by turns: on one circle an alignment takes the lever arm for a rotation.
  std::vector<eval::metrics::StampedPose> trajectory{{0, {}}};
  for (int i = 1; i < 30; ++i) {
    const Eigen::Vector3d motion(2.0, 0.0, i % 16 < 8 ? 0.3 : -0.3);
    trajectory.push_back({i * 1000000, trajectory.back().pose * geometry::SE2::Exp(motion)});
  }
  const Eigen::Vector2d antenna_m(1.5, 0.4);
  std::vector<model::GnssFix> fixes;
  for (model::Utime t = 500000; t < 29000000; t += 1300000)
    fixes.push_back(fix(t, *eval::metrics::pose_at(trajectory, t) * antenna_m));
  CHECK(against_fixes(trajectory, fixes, antenna_m).at_time_p90_m < 1e-9);
  CHECK(against_fixes(trajectory, fixes).at_time_median_m > 0.3);
}

TEST_CASE("the error of fixes is what was put in", "[victoria_park]") {
  // A straight drive; fixes alternate 1 m left and right, but for every tenth: 5 m, by pairs.
  std::vector<eval::metrics::StampedPose> trajectory;
  std::vector<model::GnssFix> fixes;
  for (int i = 0; i < 200; ++i) {
    trajectory.push_back({i * 1000000, geometry::SE2(i, 0.0, 0.0)});
    const double off = (i % 20 < 2 ? 5.0 : 1.0) * (i % 2 == 0 ? 1.0 : -1.0);
    fixes.push_back(fix(i * 1000000, {static_cast<double>(i), off}));
  }
  const eval::metrics::FixErrors errors = against_fixes(trajectory, fixes);
  CHECK(errors.at_time_median_m == Approx(1.0).margin(0.05));
  CHECK(errors.to_path_median_m == Approx(1.0).margin(0.05));
  CHECK(eval::tools::quantile(errors.at_time_m, 0.95) == Approx(5.0).margin(0.1));
  CHECK(against_fixes(trajectory, {}).at_time_m.empty());
}

TEST_CASE("lagging along the path is an error in time, not from the path", "[victoria_park]") {
  std::vector<eval::metrics::StampedPose> trajectory;
  std::vector<model::GnssFix> fixes;
  for (int i = 0; i < 200; ++i) {
    // Out and back, so that one alignment cannot take the lag away.
    const double along = 5.0 * (i < 100 ? i : 199 - i);
    const double lagged = along + (i < 100 ? -2.0 : 2.0);
    trajectory.push_back({i * 1000000, geometry::SE2(along, i < 100 ? 0.0 : 20.0, 0.0)});
    fixes.push_back(fix(i * 1000000, {lagged, i < 100 ? 0.0 : 20.0}));
  }
  const eval::metrics::FixErrors errors = against_fixes(trajectory, fixes);
  CHECK(errors.at_time_median_m > 1.5);
  CHECK(errors.to_path_median_m < 0.3);
}

TEST_CASE("trees are found, doubled and missed as they are", "[victoria_park]") {
  const auto trajectory = arc(60);
  std::vector<eval::metrics::CuratedObservation> observations;
  observe(observations, trajectory, 1, {10.0, 5.0}, 50);   // One landmark, 0.3 m off.
  observe(observations, trajectory, 2, {20.0, -8.0}, 50);  // Two landmarks.
  observe(observations, trajectory, 3, {40.0, 12.0}, 50);  // None.
  observe(observations, trajectory, 4, {60.0, 12.0}, 5);   // Too few observations to count; one.

  const std::vector<model::MapLandmark> landmarks{
      landmark(11, 10.3, 5.0), landmark(12, 20.1, -8.0), landmark(13, 20.0, -8.4),
      landmark(14, 60.0, 12.0), landmark(15, 90.0, 90.0)};

  const eval::metrics::TreeScore score = against_trees(trajectory, observations, landmarks);
  REQUIRE(score.trees.size() == 4);
  CHECK(score.well_seen == 3);
  CHECK(score.found == 2);
  CHECK(score.doubled == 1);
  CHECK(score.landmarks_elsewhere == 1);
  CHECK(score.median_spread_m < 1e-9);

  CHECK(score.trees[0].landmark == 11);
  CHECK(score.trees[0].distance_m == Approx(0.3));
  CHECK(score.trees[1].landmark == 12);  // The nearer one.
  CHECK(score.trees[1].doubles == 1);
  CHECK(score.trees[2].landmark == 0);
  CHECK(score.trees[3].landmark == 14);
}

TEST_CASE("two trees close to each other keep a landmark each", "[victoria_park]") {
  const auto trajectory = arc(60);
  std::vector<eval::metrics::CuratedObservation> observations;
  observe(observations, trajectory, 1, {10.0, 5.0}, 30);
  observe(observations, trajectory, 2, {10.7, 5.0}, 30);
  const eval::metrics::TreeScore score = against_trees(
      trajectory, observations, std::vector{landmark(1, 10.1, 5.0), landmark(2, 10.6, 5.0)});
  CHECK(score.found == 2);
  CHECK(score.doubled == 0);
  CHECK(score.trees[0].landmark == 1);
  CHECK(score.trees[1].landmark == 2);
}

TEST_CASE("the spread of a tree is that of its observations", "[victoria_park]") {
  const auto trajectory = arc(60);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 0.2);
  std::vector<eval::metrics::CuratedObservation> observations;
  observe(observations, trajectory, 1, {10.0, 5.0}, 60);

  double sum = 0.0;
  for (auto& one : observations) {
    const double dx = noise(random);
    const double dy = noise(random);
    one.position_m += Eigen::Vector2d(dx, dy);
    sum += dx * dx + dy * dy;
  }

  const eval::metrics::TreeScore score = against_trees(trajectory, observations, {});
  // Against the mean of the observations, which takes up a little of the noise.
  CHECK(score.median_spread_m == Approx(std::sqrt(sum / 60.0)).epsilon(0.1));
  CHECK(score.found == 0);
}

TEST_CASE("curated observations have their bearing from the right", "[victoria_park]") {
  const TemporaryDirectory directory;
  const auto file = directory / "trees.csv";
  std::ofstream(file) << "t_s,range_m,bearing_rad_from_right,tree_id\n1.5,10,"
                      << std::numbers::pi / 2 << ",7\n2.0,4,0,8\n3.0,4," << std::numbers::pi
                      << ",9\n";
  const auto observations = eval::metrics::read_curated_observations(file);
  REQUIRE(observations.size() == 3);
  CHECK(observations[0].utime == 1500000);
  CHECK(observations[0].tree == 7);
  CHECK((observations[0].position_m - Eigen::Vector2d(10.0, 0.0)).norm() < 1e-4);
  CHECK((observations[1].position_m - Eigen::Vector2d(0.0, -4.0)).norm() < 1e-4);
  CHECK((observations[2].position_m - Eigen::Vector2d(0.0, 4.0)).norm() < 2.5e-5);
}
