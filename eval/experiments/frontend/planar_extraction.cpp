#include "eval/experiments/frontend/planar_extraction.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "services/landmark_extractor/landmark_extractor.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "sim/sensor_drive.hpp"
#include "sim/visible_landmarks.hpp"

namespace understory::eval::experiments::frontend {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
/// The vehicle is stationary for so long, so that the gyro's bias is known, and then speeds up.
constexpr double kStationary_s = 22.0;
constexpr double kSpeedingUp_s = 8.0;
constexpr double kRecallRange_m = 25.0;
constexpr double kErrorRange_m = 20.0;
constexpr double kPlanarMatch_m = 0.5;
constexpr std::uint32_t kTrunkReturns = 3;
constexpr std::uint32_t kWallReturns = 10;

/// Square houses around the circle, none nearer than 6 m, and trunks in between.
std::shared_ptr<const sim::World> make_world(double radius_m, std::mt19937_64& random) {
  auto world = std::make_shared<sim::World>();
  std::uniform_real_distribution<double> luck(0.0, 1.0);
  std::vector<Eigen::Vector2d> taken;
  constexpr int kHouses = 8;
  for (int i = 0; i < kHouses; ++i) {
    const double bearing = kTurn * (i + 0.3 * luck(random)) / kHouses;
    const double away = radius_m + 13.0 + 6.0 * luck(random);
    const Eigen::Vector2d middle(away * std::cos(bearing), away * std::sin(bearing));
    const double turned = kTurn * luck(random);
    std::vector<Eigen::Vector2d> footprint;
    for (int k = 0; k < 4; ++k) {
      const double direction = turned + 0.25 * kTurn * k;
      footprint.emplace_back(middle +
                             4.2 * Eigen::Vector2d(std::cos(direction), std::sin(direction)));
    }
    world->add_house(footprint, 6.0);
    taken.push_back(middle);
  }

  for (int tries = 0; tries < 400; ++tries) {
    const double bearing = kTurn * luck(random);
    const double away = radius_m + (luck(random) < 0.2 ? -5.0 : 5.0 + 22.0 * luck(random));
    const Eigen::Vector2d at(away * std::cos(bearing), away * std::sin(bearing));
    const bool is_free = std::ranges::all_of(taken, [&](const Eigen::Vector2d& other) {
      const bool is_house = &other < taken.data() + kHouses;
      return (at - other).norm() > (is_house ? 7.5 : 3.5);
    });
    if (!is_free) continue;
    world->add_trunk(sim::ObjectClass::kTrunk, at, 0.1 + 0.15 * luck(random), 12.0);
    taken.push_back(at);
  }
  return world;
}

sim::SensorDrive make_drive(const PlanarDriveOptions& options) {
  std::mt19937_64 random(options.seed);
  const double radius_m = options.speed_mps / options.yaw_rate_rad_s;
  std::vector<Eigen::Vector2d> circle;
  const double driven_m = options.speed_mps * (kSpeedingUp_s + 0.1 * options.scans + 2.0);
  for (double along = 0.0; along < driven_m; along += 1.0) {
    const double angle = along / radius_m;
    circle.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle));
  }

  sim::SensorSuite suite;
  suite.lidar.reset();
  suite.gnss.reset();
  if (!options.has_motion_sensors) {
    suite.imu.reset();
    suite.wheels.reset();
  }
  suite.planar_laser.emplace();
  suite.planar_laser->revolution_s = options.revolution_s;
  sim::SpeedParameters speed;
  speed.standstill_s = kStationary_s;
  speed.cruise_mps = options.speed_mps;
  speed.lateral_mps2 = 2.0 * options.speed_mps * options.yaw_rate_rad_s;
  return {
      {make_world(radius_m, random), sim::Route::through(circle, 1.0)}, speed, suite, options.seed};
}

lidar_imu_input::LidarImuInputParameters input_of(const sim::SensorSuite& suite) {
  lidar_imu_input::LidarImuInputParameters parameters;
  if (suite.imu) {
    const Eigen::Vector3d at = suite.imu->vehicle_T_sensor.translation();
    parameters.imu.mount = {.x_m = at.x(), .y_m = at.y(), .z_m = at.z()};
  }
  const Eigen::Vector3d at = suite.planar_laser->vehicle_T_sensor.translation();
  parameters.planar.mount = {.x_m = at.x(), .y_m = at.y(), .z_m = at.z()};
  parameters.wheels.car.wheelbase_m = sim::VehicleParameters{}.wheelbase_m;
  parameters.wheels.car.encoder_left_m = suite.wheels ? suite.wheels->encoder_left_m : 0.0;
  return parameters;
}

/// Noise as simulated: round trunks, flat walls.
landmark_extractor::LandmarkExtractorParameters extractor_of(const sim::SensorSuite& suite) {
  landmark_extractor::LandmarkExtractorParameters parameters;
  parameters.planar.range_sigma_m = suite.planar_laser->range_sigma_m;
  parameters.planar.beam_width_rad = 0.0;
  parameters.planar.roundness_sigma_m = 0.002;
  parameters.planar.shape_sigma_m = 0.0;
  parameters.planar.prior_radius_m = 0.175;
  parameters.planar.prior_radius_sigma_m = 0.05;
  parameters.planar_corner.flatness_sigma_m = 0.002;
  return parameters;
}

std::vector<TrueLandmark> true_trunks(const sim::World& world, const sim::SimulatedPlanarScan& scan,
                                      const sim::VehicleState& state) {
  std::vector<TrueLandmark> result;
  for (const sim::VisibleTrunk& trunk : sim::visible_trunks(world, scan, state)) {
    const bool should = trunk.range_m <= kRecallRange_m && trunk.returns >= kTrunkReturns;
    result.push_back({trunk.centre_m, std::nullopt, trunk.returns, should, false});
  }
  return result;
}

/// All corners; those must be found both of whose walls gave enough returns.
std::vector<TrueLandmark> true_corners(const sim::World& world,
                                       const sim::SimulatedPlanarScan& scan,
                                       const sim::VehicleState& state) {
  std::map<sim::ObjectId, std::uint32_t> returns;
  for (std::size_t i = 0; i < scan.objects.size(); ++i)
    if (scan.is_return[i] != 0) ++returns[scan.objects[i]];
  std::vector<TrueLandmark> result;
  for (const sim::TrueCorner& corner : world.corners()) {
    const std::uint32_t least = std::min(returns[corner.wall_before], returns[corner.wall_after]);
    const Eigen::Vector2d at = state.world_T_level().inverse() * corner.position_m;
    const bool should = at.norm() <= kRecallRange_m && least >= kWallReturns;
    result.push_back({{at.x(), at.y(), 1.3},
                      std::remainder(corner.bisector_rad - state.yaw_rad, kTurn),
                      least,
                      should,
                      false});
  }
  return result;
}

/// The stages behind each other, and the truth beside.
class PlanarRun {
 public:
  PlanarRun(sim::SensorDrive& drive, const PlanarDriveOptions& options)
      : drive_(drive),
        options_(options),
        input_(input_of(drive.suite())),
        extractor_(extractor_of(drive.suite())) {}

  void add(const sim::SensorReading& reading) {
    if (const auto* imu = std::get_if<model::ImuSample>(&reading)) take(input_.add(*imu));
    if (const auto* wheels = std::get_if<model::WheelSample>(&reading)) take(input_.add(*wheels));
    const auto* scan = std::get_if<sim::SimulatedPlanarScan>(&reading);
    if (scan == nullptr) return;
    model::PlanarScan raw = scan->scan;
    if (!options_.has_beam_times) raw.beam_interval_s = 0.0;
    waiting_[raw.sequence] = *scan;
    take(input_.add(raw));
  }
  void finish() { take(input_.finish()); }

  bool is_done() const { return score_.scans >= static_cast<std::uint64_t>(options_.scans); }
  PlanarScore score() const {
    PlanarScore score = score_;
    score.not_deskewed = input_.counters().sweeps_not_deskewed;
    score.trunks = trunks_.score();
    score.corners = corners_.score();
    return score;
  }

 private:
  void take(const lidar_imu_input::InputResults& results) {
    for (const lidar_imu_input::InputResult& result : results) {
      if (const auto* sweep = std::get_if<model::PointSweep>(&result))
        judge(extractor_.extract(*sweep), sweep->revolution);
      if (const auto* scan = std::get_if<model::PlanarScan>(&result))
        judge(extractor_.extract(*scan), scan->sequence);
    }
  }

  void judge(const model::LandmarkScan& found, std::uint64_t number) {
    const auto simulated = waiting_.extract(number);
    const double time_s = 1e-6 * static_cast<double>(found.utime);
    if (simulated.empty() || time_s < kStationary_s + kSpeedingUp_s || is_done()) return;
    const sim::VehicleState state = drive_.state_at(found.utime);
    trunks_.add(found, model::LandmarkKind::kTrunk,
                true_trunks(drive_.world(), simulated.mapped(), state), misses_);
    corners_.add(found, model::LandmarkKind::kCorner,
                 true_corners(drive_.world(), simulated.mapped(), state), misses_);
    ++score_.scans;
  }

  sim::SensorDrive& drive_;
  PlanarDriveOptions options_;
  lidar_imu_input::LidarImuInput input_;
  landmark_extractor::LandmarkExtractor extractor_;
  std::map<std::uint64_t, sim::SimulatedPlanarScan> waiting_;
  KindTally trunks_{kPlanarMatch_m, kErrorRange_m};
  KindTally corners_{kPlanarMatch_m, kErrorRange_m};
  std::vector<ExtractionMiss> misses_;
  PlanarScore score_;
};

}  // namespace

PlanarScore score_planar_drive(const PlanarDriveOptions& options) {
  sim::SensorDrive drive = make_drive(options);
  PlanarRun run(drive, options);
  while (!run.is_done()) {
    const auto reading = drive.next();
    if (!reading) break;
    run.add(*reading);
  }
  run.finish();
  return run.score();
}

}  // namespace understory::eval::experiments::frontend
