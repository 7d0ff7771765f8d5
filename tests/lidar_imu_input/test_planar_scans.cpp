// Scans of a laser with one plane: de-skewed as sweeps are, or published as they were taken.
#include <algorithm>
#include <cmath>
#include <random>

#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

constexpr std::size_t kBeams = 361;
constexpr double kBeamInterval_s = 0.05 / 360.0;

/// Level, 5 m/s, curves of 30 degrees/s at most.
test::Drive level_drive() {
  test::Drive drive;
  drive.stand_s = 2.0;
  drive.top_speed_mps = 5.0;
  drive.turn_rad_s = 0.5;
  drive.tilt_rad = 0.0;
  drive.rough_rad = 0.0;
  return drive;
}

/// Round posts of 1 m radius all around, level with the laser.
class PlanarVehicle {
 public:
  PlanarVehicle() : drive_(level_drive()), track_(drive_, 30.0) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> place(-60.0, 60.0);
    for (int i = 0; i < 150; ++i) {
      const double x = place(random);
      posts_.emplace_back(x, place(random));
    }
    parameters_.planar.mount = {.x_m = 3.6, .y_m = 0.2, .yaw_rad = 0.1};
  }

  model::PlanarScan scan(model::Utime utime, double beam_interval_s = kBeamInterval_s) const {
    model::PlanarScan scan;
    scan.utime = utime;
    scan.sequence = static_cast<std::uint64_t>(utime / 100'000);
    scan.first_bearing_rad = -1.57;
    scan.bearing_step_rad = 3.14 / 360.0;
    scan.max_range_m = 80.0;
    scan.beam_interval_s = beam_interval_s;
    for (std::size_t beam = 0; beam < kBeams; ++beam) {
      const double at_s = test::seconds(utime) + static_cast<double>(beam) * beam_interval_s;
      const geometry::SE2 world_T_sensor = track_.planar(at_s) * vehicle_T_sensor();
      scan.ranges_m.push_back(static_cast<float>(range(world_T_sensor, scan.bearing(beam))));
    }
    return scan;
  }

  /// RMS distance of the sweep's points from the nearest post's surface [m].
  double error_m(const model::PointSweep& sweep) const {
    const geometry::SE2 world_T_vehicle = track_.planar(test::seconds(sweep.utime));
    double sum = 0.0;
    for (const model::SweepPoint& point : sweep.points) {
      const Eigen::Vector2d at =
          world_T_vehicle * Eigen::Vector2d(point.position().head<2>().cast<double>());
      double least = 1e9;
      for (const Eigen::Vector2d& post : posts_)
        least = std::min(least, std::abs((at - post).norm() - kRadius_m));
      sum += least * least;
    }
    return std::sqrt(sum / static_cast<double>(sweep.points.size()));
  }

  /// IMU, wheels and scans up to a time; the scans come when they are complete.
  InputResults drive_to(LidarImuInput& input, model::Utime end, double beam_interval_s) {
    InputResults all;
    const auto keep = [&](InputResults results) {
      for (InputResult& result : results) all.push_back(std::move(result));
    };
    for (; now_ < end; now_ += 10'000) {
      keep(input.add(imu_at(drive_, now_, 100.0, {}, random_)));
      if (now_ % 20'000 == 0) keep(input.add(wheels_at(drive_, now_, {}, random_)));
      if (now_ % 100'000 == 50'000) keep(input.add(scan(now_ - 50'000, beam_interval_s)));
    }
    return all;
  }

  const LidarImuInputParameters& parameters() const { return parameters_; }

 private:
  static constexpr double kRadius_m = 1.0;

  geometry::SE2 vehicle_T_sensor() const {
    const SensorMount& mount = parameters_.planar.mount;
    return {mount.x_m, mount.y_m, mount.yaw_rad};
  }
  double range(const geometry::SE2& world_T_sensor, double bearing_rad) const {
    const Eigen::Vector2d origin = world_T_sensor.translation();
    const Eigen::Vector2d beam =
        world_T_sensor.rotation() * Eigen::Vector2d(std::cos(bearing_rad), std::sin(bearing_rad));
    double least = 80.0;
    for (const Eigen::Vector2d& post : posts_) {
      const Eigen::Vector2d away = post - origin;
      const double along = away.dot(beam);
      const double inside = kRadius_m * kRadius_m - away.squaredNorm() + along * along;
      if (inside > 0.0 && along > kRadius_m) least = std::min(least, along - std::sqrt(inside));
    }
    return least;
  }

  test::Drive drive_;
  test::Track track_;
  std::vector<Eigen::Vector2d> posts_;
  LidarImuInputParameters parameters_ = parameters_for_drive();
  std::mt19937_64 random_{1};
  model::Utime now_ = 0;
};

template <class T>
std::vector<T> all_in(const InputResults& results) {
  std::vector<T> found;
  for (const InputResult& result : results)
    if (const auto* one = std::get_if<T>(&result)) found.push_back(*one);
  return found;
}

/// Faults of a kind on RAW_SCAN.
std::size_t faults(const InputResults& results, InputFaultKind kind) {
  return static_cast<std::size_t>(std::ranges::count_if(
      all_in<InputFault>(results),
      [&](const InputFault& fault) { return fault.kind == kind && fault.channel == "RAW_SCAN"; }));
}

}  // namespace

TEST_CASE("a scan whose beams come one after another is de-skewed as a sweep of one ring",
          "[stage][deskew]") {
  PlanarVehicle vehicle;
  LidarImuInput input(vehicle.parameters());
  const InputResults results = vehicle.drive_to(input, 14'000'000, kBeamInterval_s);
  CHECK(all_in<model::PlanarScan>(results).empty());
  CHECK(faults(results, InputFaultKind::kNoMotion) == 0);

  double worst = 0.0;
  double worst_skewed = 0.0;
  std::size_t driven = 0;
  for (const model::PointSweep& sweep : all_in<model::PointSweep>(results)) {
    CHECK(sweep.rings == 1);
    CHECK(sweep.is_deskewed);
    CHECK(sweep.sensor_position_m.isApprox(Eigen::Vector3d(3.6, 0.2, 0.0)));
    // The stamp is that of the last beam.
    CHECK(sweep.utime % 100'000 == 50'000);
    if (test::seconds(sweep.utime) < 6.0) continue;
    ++driven;
    worst = std::max(worst, vehicle.error_m(sweep));
    // As it was before: all beams at the time of the first one, and without de-skewing.
    LidarImuInput blind(vehicle.parameters());
    InputResults skewed;
    for (int k = -2; k <= 0; ++k)
      for (InputResult& result : blind.add(vehicle.scan(sweep.utime - 50'000 + k * 100'000)))
        skewed.push_back(std::move(result));
    CHECK(faults(skewed, InputFaultKind::kNoMotion) > 0);
    const auto as_it_is = all_in<model::PointSweep>(skewed);
    REQUIRE(!as_it_is.empty());
    worst_skewed = std::max(worst_skewed, vehicle.error_m(as_it_is.back()));
  }
  CHECK(driven > 70);
  CHECK(worst < 0.005);
  CHECK(worst_skewed > 0.2);
}

TEST_CASE("every scan's increment of odometry ends at its last beam", "[stage]") {
  PlanarVehicle vehicle;
  LidarImuInput input(vehicle.parameters());
  const InputResults results = vehicle.drive_to(input, 5'000'000, kBeamInterval_s);
  std::optional<model::Utime> increment_end;
  std::size_t sweeps = 0;
  for (const InputResult& result : results) {
    if (const auto* increment = std::get_if<model::Odometry>(&result))
      increment_end = increment->utime;
    if (const auto* sweep = std::get_if<model::PointSweep>(&result)) {
      if (increment_end) CHECK(sweep->utime == *increment_end);
      ++sweeps;
    }
  }
  CHECK(sweeps > 40);
}

TEST_CASE("a scan taken at once goes out as it is, with the laser's place", "[stage]") {
  PlanarVehicle vehicle;
  LidarImuInput input(vehicle.parameters());
  const InputResults results = vehicle.drive_to(input, 5'000'000, 0.0);
  CHECK(all_in<model::PointSweep>(results).empty());
  const auto scans = all_in<model::PlanarScan>(results);
  REQUIRE(scans.size() > 40);
  for (const model::PlanarScan& scan : scans) {
    CHECK(scan.ranges_m == vehicle.scan(scan.utime, 0.0).ranges_m);
    CHECK(scan.vehicle_T_sensor.coordinates().isApprox(Eigen::Vector3d(3.6, 0.2, 0.1)));
  }
}

TEST_CASE("beams over more than a revolution are taken as one instant, and named", "[stage]") {
  PlanarVehicle vehicle;
  LidarImuInput input(vehicle.parameters());
  InputResults results;
  for (int k = 0; k < 4; ++k)
    for (InputResult& result : input.add(vehicle.scan(1'000'000 + k * 100'000, 0.01)))
      results.push_back(std::move(result));
  for (InputResult& result : input.finish()) results.push_back(std::move(result));
  CHECK(faults(results, InputFaultKind::kNoPointTimes) == 4);
  CHECK(all_in<model::PlanarScan>(results).size() == 4);
}

TEST_CASE("scans that wait are de-skewed after a restart, too", "[state]") {
  PlanarVehicle vehicle;
  LidarImuInput input(vehicle.parameters());
  vehicle.drive_to(input, 9'060'000, kBeamInterval_s);
  LidarImuInput loaded(vehicle.parameters());
  loaded.load(input.save());
  const InputResults results = vehicle.drive_to(loaded, 10'000'000, kBeamInterval_s);
  const auto sweeps = all_in<model::PointSweep>(results);
  REQUIRE(sweeps.size() > 7);
  for (const model::PointSweep& sweep : sweeps) CHECK(vehicle.error_m(sweep) < 0.005);
}
