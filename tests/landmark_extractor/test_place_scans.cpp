// Clouds for loop detectors.
#include <cmath>
#include <random>

#include "services/landmark_extractor/place/place_scans.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::landmark_extractor;
using namespace understory::landmark_extractor::place;

namespace {

std::vector<Eigen::Vector3f> random_points(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> place(-50.0F, 50.0F);
  std::uniform_real_distribution<float> height(-2.0F, 12.0F);
  std::vector<Eigen::Vector3f> points;
  while (points.size() < count) {
    const float x = place(random), y = place(random);
    points.emplace_back(x, y, height(random));
  }
  return points;
}

Eigen::Vector3i cube_of(const Eigen::Vector3f& point, double cube_m) {
  return (point / static_cast<float>(cube_m)).array().floor().cast<int>();
}

}  // namespace

TEST_CASE("Of each cube one point is kept, the nearest to its middle", "[place_scan]") {
  const PlaceScanParameters parameters{.cube_m = 2.0, .max_range_m = 30.0, .most_points = 9900};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const auto points = random_points(seed, 3000);
    const auto kept = down_sampled(points, parameters);

    // Slowly: every point against all of its cube.
    std::vector<model::PlacePoint> expected;
    for (const Eigen::Vector3f& point : points) {
      if (point.head<2>().norm() > 30.0F) continue;
      const Eigen::Vector3i cube = cube_of(point, 2.0);
      const Eigen::Vector3f middle = 2.0F * (cube.cast<float>().array() + 0.5F).matrix();
      const bool is_nearest = std::ranges::none_of(points, [&](const Eigen::Vector3f& other) {
        return other.head<2>().norm() <= 30.0F && cube_of(other, 2.0) == cube &&
               (other - middle).norm() < (point - middle).norm();
      });
      if (is_nearest) expected.push_back(model::place_point(point));
    }
    CHECK(kept.size() == expected.size());
    for (const model::PlacePoint& point : kept) CHECK(std::ranges::count(expected, point) == 1);
  }
}

TEST_CASE("Too many points are thinned everywhere alike; what is no number is left out",
          "[place_scan]") {
  auto points = random_points(3, 20000);
  points.emplace_back(NAN, 0.0F, 0.0F);
  points.emplace_back(0.0F, INFINITY, 0.0F);
  points.emplace_back(0.0F, 0.0F, 1e6F);
  const PlaceScanParameters parameters{.cube_m = 0.5, .max_range_m = 50.0, .most_points = 800};
  const auto kept = down_sampled(points, parameters);
  REQUIRE(kept.size() == 800);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const auto in_quarter = std::ranges::count_if(kept, [&](const model::PlacePoint& point) {
      return (point.x_cm > 0) == (quarter % 2 == 0) && (point.y_cm > 0) == (quarter / 2 == 0);
    });
    CHECK(in_quarter > 150);
    CHECK(in_quarter < 250);
  }
  CHECK(down_sampled({}, parameters).empty());
}

TEST_CASE("A sweep's cloud is levelled", "[place_scan]") {
  model::PointSweep sweep;
  sweep.utime = 70;
  const Eigen::Quaterniond level(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()));
  sweep.attitude = model::Attitude{level, Eigen::Matrix2d::Zero()};
  const Eigen::Vector3f in_level(8.0F, -6.0F, 1.5F);
  const Eigen::Vector3f in_vehicle = level.conjugate().cast<float>() * in_level;
  sweep.points.push_back({.x_m = in_vehicle.x(), .y_m = in_vehicle.y(), .z_m = in_vehicle.z()});
  const model::PlaceScan scan = place_scan_of(sweep, {});
  CHECK(scan.utime == 70);
  REQUIRE(scan.points.size() == 1);
  CHECK((scan.points[0].position_m() - in_level).norm() < 0.01F);
}

TEST_CASE("A scan's cloud has its returns, in the vehicle's frame", "[place_scan]") {
  model::PlanarScan scan;
  scan.first_bearing_rad = -0.5;
  scan.bearing_step_rad = 0.5;
  scan.max_range_m = 30.0;
  scan.ranges_m = {10.0F, 31.0F, NAN, 5.0F};
  scan.vehicle_T_sensor = geometry::SE2(1.0, 2.0, 0.5);
  const model::PlaceScan cloud = place_scan_of(scan, {});
  REQUIRE(cloud.points.size() == 2);
  const Eigen::Vector2d first =
      scan.vehicle_T_sensor * Eigen::Vector2d(10.0 * std::cos(-0.5), 10.0 * std::sin(-0.5));
  CHECK(std::ranges::count(cloud.points,
                           model::place_point({static_cast<float>(first.x()),
                                               static_cast<float>(first.y()), 0.0F})) == 1);
}

TEST_CASE("A cloud comes once a period, and none where nobody wants it", "[place_scan]") {
  const auto made = [](double period_s, model::Utime jump_us) {
    PlaceScans scans({.period_s = period_s});
    int count = 0;
    model::PointSweep sweep;
    sweep.points.push_back({.x_m = 3.0F, .y_m = 0.0F, .z_m = 1.0F});
    for (int k = 0; k < 40; ++k) {
      sweep.utime = 1'000'000'000 + k * 100'000 + (k >= 20 ? jump_us : 0);
      if (scans.add(sweep)) ++count;
    }
    return count;
  };
  CHECK(made(0.0, 0) == 0);
  CHECK(made(0.5, 0) == 8);
  // A clock that jumps back does not silence it.
  CHECK(made(0.5, -500'000'000) == 8);
}
