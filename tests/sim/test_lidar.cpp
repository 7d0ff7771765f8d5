#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "sim/planar_laser.hpp"
#include "sim/scenarios.hpp"
#include "sim/sensor_drive.hpp"
#include "sim/spinning_lidar.hpp"
#include "sim/visible_landmarks.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;
using namespace understory::sim;
using std::numbers::pi;

namespace {

ForestScenarioParameters small_forest() {
  ForestScenarioParameters parameters;
  parameters.length_m = 60.0;
  parameters.margin_m = 50.0;
  return parameters;
}

LidarParameters coarse_lidar() {
  LidarParameters lidar;
  lidar.elevations_rad = beam_elevations_rad(LidarModel::kVlp16);
  lidar.columns = 600;
  return lidar;
}

SensorSuite coarse_suite() {
  SensorSuite suite;
  suite.lidar = coarse_lidar();
  return suite;
}

SpeedParameters short_standstill() {
  SpeedParameters speed;
  speed.standstill_s = 1.0;
  return speed;
}

bool same_points(const model::PointSweep& a, const model::PointSweep& b) {
  return a.utime == b.utime &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(),
                    [](const model::SweepPoint& p, const model::SweepPoint& q) {
                      return p.position() == q.position() && p.time_s == q.time_s &&
                             p.ring == q.ring && p.intensity == q.intensity;
                    });
}

/// A level world with one thick trunk 10 m ahead and, behind it, one to be hidden.
World two_trunks() {
  World world;
  world.add_trunk(ObjectClass::kTrunk, {10.0, 0.0}, 0.4, 15.0);
  world.add_trunk(ObjectClass::kTrunk, {20.0, 0.0}, 0.2, 15.0);
  world.add_trunk(ObjectClass::kTrunk, {0.0, 15.0}, 0.2, 15.0, 0.01, {0.1, -0.05});
  return world;
}

LidarParameters exact_lidar() {
  LidarParameters lidar;
  lidar.range_sigma_m = 0.0;
  lidar.beam_half_width_rad = 0.0;
  lidar.drop_out = 0.0;
  lidar.white_range_m = 0.0;
  return lidar;
}

}  // namespace

TEST_CASE("Tables of beams are those of the makers", "[lidar]") {
  const auto [model, count, lowest_deg, highest_deg] = GENERATE(
      table<LidarModel, std::size_t, double, double>({{LidarModel::kVlp16, 16, -15.0, 15.0},
                                                      {LidarModel::kVlp32, 32, -25.0, 15.0},
                                                      {LidarModel::kHdl32, 32, -30.67, 10.67},
                                                      {LidarModel::kHdl64, 64, -24.33, 2.0}}));
  const auto elevations = beam_elevations_rad(model);
  CHECK(elevations.size() == count);
  CHECK(std::is_sorted(elevations.begin(), elevations.end()));
  CHECK(elevations.front() * 180.0 / pi == Approx(lowest_deg).margin(0.01));
  CHECK(elevations.back() * 180.0 / pi == Approx(highest_deg).margin(0.01));
}

TEST_CASE("Points of a trunk lie on its surface, and one trunk hides another", "[lidar]") {
  const World world = two_trunks();
  SpinningLidar lidar(world, exact_lidar(), 1);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const SimulatedSweep sweep = lidar.sweep_stationary(pose);
  std::array<int, 3> returns{};
  for (std::size_t i = 0; i < sweep.objects.size(); ++i) {
    if (sweep.objects[i] == kGroundObject) {
      CHECK(std::abs(sweep.true_m[i].z()) < 1e-4);
      continue;
    }
    ++returns.at(sweep.objects[i]);
    const Eigen::Vector3d p = sweep.true_m[i].cast<double>();
    const Eigen::Vector3d axis = sweep.objects[i] == 2
                                     ? Eigen::Vector3d(0.1, -0.05, 1.0).normalized()
                                     : Eigen::Vector3d::UnitZ();
    const TrueTrunk& trunk = world.trunks()[sweep.objects[i]];
    const Eigen::Vector3d away = p - trunk.centre_m;
    const double along = away.dot(axis);
    const double taper = sweep.objects[i] == 2 ? 0.01 : 0.0;
    CHECK((away - along * axis).norm() == Approx(trunk.radius_m - taper * along).margin(2e-5));
  }
  CHECK(returns[0] > 300);
  CHECK(returns[1] == 0);
  CHECK(returns[2] > 50);

  VehicleState state;
  const auto seen = visible_trunks(world, sweep, state, 5);
  REQUIRE(seen.size() == 2);
  CHECK(seen[0].object == 0);
  CHECK(seen[1].object == 2);
  CHECK((seen[1].centre_m - Eigen::Vector3d(0.0, 15.0, 1.3)).norm() < 1e-9);
  CHECK(seen[1].range_m == Approx(15.0));
}

TEST_CASE("A raw sweep is skewed by exactly the motion of the vehicle", "[lidar]") {
  SensorSuite suite = coarse_suite();
  suite.lidar->range_sigma_m = 0.0;
  suite.lidar->beam_half_width_rad = 0.0;
  suite.lidar->vehicle_T_sensor =
      Eigen::Translation3d(1.0, 0.2, 1.7) *
      Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.3, -0.5, 1).normalized());
  SensorDrive drive(forest_scenario(small_forest(), 1), short_standstill(), suite, 1);
  const SimulatedSweep sweep = drive.sweep(60);
  REQUIRE(sweep.raw.points.size() > 3000);

  CHECK(drive.motion().at(6.0).velocity_mps.norm() > 2.0);
  double worst_standing_m = 0.0;
  for (std::size_t i = 0; i < sweep.raw.points.size(); ++i) {
    const model::SweepPoint& point = sweep.raw.points[i];
    if (i > 0) REQUIRE(point.time_s >= sweep.raw.points[i - 1].time_s);
    const double time_s = 1e-6 * static_cast<double>(sweep.raw.utime) + point.time_s;
    const auto world_m = [&](double at_s) -> Eigen::Vector3d {
      return drive.motion().at(at_s).world_T_vehicle() * suite.lidar->vehicle_T_sensor *
             point.position().cast<double>();
    };
    const Eigen::Vector3d truth = sweep.true_m[i].cast<double>();
    REQUIRE((world_m(time_s) - truth).norm() < 1.5e-5);
    worst_standing_m = std::max(
        worst_standing_m, (world_m(1e-6 * static_cast<double>(sweep.raw.utime)) - truth).norm());
  }

  CHECK(worst_standing_m > 0.2);
  CHECK(sweep.raw.points.front().time_s < 2e-6F);
  CHECK(sweep.raw.points.back().time_s < 0.1F);
  CHECK(sweep.raw.utime >= 6'000'000);
}

TEST_CASE("Beams are as wide as asked for", "[lidar]") {
  const World world = two_trunks();
  LidarParameters wide = exact_lidar();
  wide.beam_half_width_rad = 2e-3;
  const SimulatedSweep sweep =
      SpinningLidar(world, wide, 1).sweep_stationary(Eigen::Isometry3d::Identity());
  double greatest = 0.0;
  double squares = 0.0;

  for (std::size_t i = 0; i < sweep.raw.points.size(); ++i) {
    const Eigen::Vector3d told = sweep.raw.points[i].position().cast<double>().normalized();
    const Eigen::Vector3d hit =
        (sweep.true_m[i].cast<double>() - wide.vehicle_T_sensor.translation()).normalized();
    greatest = std::max(greatest, (told - hit).norm());
    squares += (told - hit).squaredNorm();
  }

  CHECK(greatest < 2e-3 * std::sqrt(2.0) + 1e-6);

  // Uniform in a square.
  const double expected = 2e-3 * std::sqrt(2.0 / 3.0);
  CHECK(std::sqrt(squares / static_cast<double>(sweep.raw.points.size())) ==
        Approx(expected).epsilon(0.02));
}

TEST_CASE("Noise of range and share of lost returns are as asked for", "[lidar]") {
  const Scenario scenario = forest_scenario(small_forest(), 2);
  LidarParameters exact = exact_lidar();
  exact.columns = 600;
  LidarParameters noisy = exact;
  noisy.range_sigma_m = 0.03;
  noisy.drop_out = 0.1;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();

  pose.translation() << scenario.route.at(10.0).position_m, 0.0;
  pose.translation().z() = scenario.world->ground().height(pose.translation().head<2>());
  const SimulatedSweep clean = SpinningLidar(*scenario.world, exact, 3).sweep_stationary(pose);
  const SimulatedSweep sweep = SpinningLidar(*scenario.world, noisy, 3).sweep_stationary(pose);
  const double kept =
      static_cast<double>(sweep.raw.points.size()) / static_cast<double>(clean.raw.points.size());
  CHECK(kept == Approx(0.9).margin(0.015));
  const Eigen::Vector3d origin = pose * exact.vehicle_T_sensor.translation();

  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < sweep.raw.points.size(); ++i) {
    const double error = sweep.raw.points[i].position().cast<double>().norm() -
                         (sweep.true_m[i].cast<double>() - origin).norm();
    sum += error;
    squares += error * error;
  }

  const auto n = static_cast<double>(sweep.raw.points.size());
  CHECK(std::abs(sum / n) < 4e-4);
  CHECK(std::sqrt(squares / n) == Approx(0.03).epsilon(0.03));
}

TEST_CASE("A drive's readings come in order and follow from the seed", "[drive]") {
  const Scenario scenario = forest_scenario(small_forest(), 3);
  SensorSuite suite = coarse_suite();
  suite.planar_laser = PlanarLaserParameters{};
  SensorDrive first(scenario, short_standstill(), suite, 7);
  SensorDrive second(forest_scenario(small_forest(), 3), short_standstill(), suite, 7);
  SensorDrive other(scenario, short_standstill(), suite, 8);
  const model::PointSweep asked_before = second.sweep(30).raw;

  CHECK_FALSE(same_points(asked_before, other.sweep(30).raw));
  model::Utime last = 0;
  std::array<int, 6> counts{};

  for (int i = 0; i < 1500; ++i) {
    const auto a = first.next();
    const auto b = second.next();
    REQUIRE(a.has_value());
    REQUIRE(b.has_value());
    REQUIRE(a->index() == b->index());
    ++counts.at(a->index());
    model::Utime complete = 0;

    if (const auto* imu = std::get_if<model::ImuSample>(&*a)) {
      complete = imu->utime;
      CHECK(imu->specific_force_mps2 == std::get<model::ImuSample>(*b).specific_force_mps2);
    } else if (const auto* sweep = std::get_if<SimulatedSweep>(&*a)) {
      CHECK(same_points(sweep->raw, std::get<SimulatedSweep>(*b).raw));
      if (sweep->raw.revolution == 30) CHECK(same_points(sweep->raw, asked_before));
      complete = static_cast<model::Utime>(sweep->raw.revolution + 1) * 100'000;
    } else if (const auto* pose = std::get_if<TruePose>(&*a)) {
      complete = pose->utime;
    } else if (const auto* scan = std::get_if<SimulatedPlanarScan>(&*a)) {
      complete = scan->scan.end();
      CHECK(scan->scan.ranges_m == std::get<SimulatedPlanarScan>(*b).scan.ranges_m);
    } else {
      continue;
    }

    CHECK(complete >= last);
    last = complete;
  }

  for (const int count : counts) CHECK(count > 0);
}

TEST_CASE("A drive ends when its time is over", "[drive]") {
  SensorSuite suite;
  suite.lidar.reset();
  suite.wheels.reset();
  suite.gnss.reset();
  SensorDrive drive(forest_scenario(small_forest(), 3), short_standstill(), suite, 7);
  std::size_t samples = 0;
  while (const auto reading = drive.next()) {
    samples += std::holds_alternative<model::ImuSample>(*reading) ? 1 : 0;
  }
  CHECK(static_cast<double>(samples) == Approx(200.0 * drive.motion().duration_s()).margin(2.0));
}

TEST_CASE("Corners of houses are listed with the returns on their walls", "[lidar]") {
  World world;

  // Ten metres ahead: its near corner points at the sensor.
  const Eigen::Vector2d corner(10.0, 0.0);
  const std::vector<Eigen::Vector2d> square{corner, corner + Eigen::Vector2d(6.0, -6.0),
                                            corner + Eigen::Vector2d(12.0, 0.0),
                                            corner + Eigen::Vector2d(6.0, 6.0)};
  world.add_house(square, 5.0);
  SpinningLidar lidar(world, exact_lidar(), 1);
  const SimulatedSweep sweep = lidar.sweep_stationary(Eigen::Isometry3d::Identity());
  VehicleState state;
  state.yaw_rad = 0.5;
  state.world_Q_vehicle = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
  const auto corners = visible_corners(world, sweep, state);
  REQUIRE(corners.size() == 3);  // the far one is hidden
  const auto& near = corners.front();
  CHECK(near.corner == 0);
  CHECK(near.angle_rad == Approx(1.5 * pi));
  CHECK(std::abs(geometry::wrap_angle(near.bisector_rad - (pi - 0.5))) < 1e-9);

  CHECK(near.range_m == Approx(10.0));
  CHECK(near.position_m.x() == Approx(10.0 * std::cos(0.5)));
  CHECK(near.position_m.y() == Approx(-10.0 * std::sin(0.5)));
  CHECK(near.returns_before > 100);
  CHECK(near.returns_after > 100);

  // Of the corners at the sides, one wall is on the far side.
  for (std::size_t i = 1; i < 3; ++i) {
    CHECK(std::min(corners[i].returns_before, corners[i].returns_after) == 0);
    CHECK(std::max(corners[i].returns_before, corners[i].returns_after) > 20);
  }
}

TEST_CASE("A planar laser measures the plane of its beams", "[lidar]") {
  World world;
  world.add_trunk(ObjectClass::kTrunk, {13.6, 5.0}, 0.3, 15.0);
  PlanarLaserParameters parameters;
  parameters.range_sigma_m = 0.0;
  parameters.drop_out = 0.0;
  PlanarLaser laser(world, parameters, 1);
  const std::vector<Eigen::Vector2d> path{{0, 0}, {30, 0}};

  const VehicleMotion motion(Route::through(path, 1.0), world.ground(), {}, {});
  const SimulatedPlanarScan simulated = laser.scan(motion, 0);
  REQUIRE(simulated.scan.ranges_m.size() == 361);
  int hits = 0;

  for (std::size_t beam = 0; beam < 361; ++beam) {
    CHECK(simulated.scan.is_return(beam) == (simulated.is_return[beam] != 0));
    if (!simulated.scan.is_return(beam)) continue;
    ++hits;
    const double bearing = simulated.scan.bearing(beam);
    const Eigen::Vector2d p =
        Eigen::Vector2d(3.6, 0.0) + double(simulated.scan.ranges_m[beam]) *
                                        Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    CHECK((p - Eigen::Vector2d(13.6, 5.0)).norm() == Approx(0.3).margin(1e-4));
  }

  // 0.6 m wide at 11.2 m: 3.1 degrees.
  CHECK(hits >= 5);
  CHECK(hits <= 7);
  CHECK(visible_trunks(world, simulated, motion.at(0.0), 5).size() == 1);
}
