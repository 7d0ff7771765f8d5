#include "deploy/cli/sensor_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "common/io/text_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/original_log.hpp"
#include "sim/point_grid.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::cli {
namespace {

constexpr std::string_view kPoles = "poles:";
/// With 10 bytes each, a message stays below the 64 KiB of one datagram.
constexpr std::size_t kPointsPerMessage = 5900;
constexpr double kLandmarkReach = 40.0;

sim::Scenario forest_scenario(const SensorSimulationOptions& options) {
  sim::ForestScenarioParameters parameters;
  const auto kind = sim::forest_kind(options.forest);
  if (!kind) wrong_usage(fmt::format("--forest {}: no such forest", options.forest));
  const auto path = sim::path_kind(options.path);
  if (!path) wrong_usage(fmt::format("--path {}: no such path", options.path));
  if (*path == sim::PathKind::kStationary)
    wrong_usage("--path stationary: for ideal landmarks alone; --standstill stands with sensors");
  parameters.forest = sim::forest_parameters(*kind);
  parameters.path = *path;
  parameters.length_m = options.length_m;
  parameters.laps = options.laps;
  return sim::forest_scenario(parameters, options.seed);
}

sim::Scenario pole_scenario(const SensorSimulationOptions& options) {
  const std::string files = options.world.substr(kPoles.size());
  const auto comma = files.find(',');
  if (comma == std::string::npos) {
    wrong_usage(fmt::format("{}: poles:POLES.csv,TRAJECTORY.csv is wanted", options.world));
  }
  const std::string poles = io::read_whole_file(files.substr(0, comma));
  const std::string trajectory = io::read_whole_file(files.substr(comma + 1));
  auto result = sim::pole_map_scenario(poles, trajectory, options.seed);
  if (!result.scenario) fail(fmt::format("{}: {}", files, result.error));
  return std::move(*result.scenario);
}

struct SensorWorld {
  std::string_view name;
  sim::Scenario (*scenario)(const SensorSimulationOptions& options);
};
constexpr std::array<SensorWorld, 4> kSensorWorlds{
    {{"forest3d", forest_scenario},
     {"urban",
      [](const SensorSimulationOptions& o) { return sim::urban_scenario(o.laps, o.seed); }},
     {"urban-countryside",
      [](const SensorSimulationOptions& o) {
        return sim::urban_to_countryside_scenario(o.length_m, o.seed);
      }},
     {"countryside", [](const SensorSimulationOptions& o) {
        return sim::countryside_scenario(o.length_m, o.seed);
      }}}};

sim::Scenario scenario_of(const SensorSimulationOptions& options) {
  const auto* const world = std::ranges::find(kSensorWorlds, options.world, &SensorWorld::name);
  return world != kSensorWorlds.end() ? world->scenario(options) : pole_scenario(options);
}

struct Laser {
  std::string_view name;
  sim::LidarModel model;
  int columns;
};
constexpr std::array<Laser, 4> kLasers{{{"vlp16", sim::LidarModel::kVlp16, 1800},
                                        {"vlp32", sim::LidarModel::kVlp32, 1800},
                                        {"hdl32", sim::LidarModel::kHdl32, 2160},
                                        {"hdl64", sim::LidarModel::kHdl64, 2048}}};
constexpr std::string_view kNoLaser = "none";

std::optional<sim::LidarParameters> lidar_of(const std::string& name) {
  if (name == kNoLaser) return std::nullopt;
  const auto* const laser = std::ranges::find(kLasers, name, &Laser::name);
  if (laser == kLasers.end()) wrong_usage(fmt::format("--lidar {}: no such model", name));
  sim::LidarParameters lidar;
  lidar.elevations_rad = sim::beam_elevations_rad(laser->model);
  lidar.columns = laser->columns;
  return lidar;
}

truth_landmark_t truth_landmark(std::size_t id, const Eigen::Vector2d& position_m, double radius_m,
                                model::LandmarkKind kind) {
  truth_landmark_t landmark{};
  landmark.id = static_cast<std::int64_t>(id);
  landmark.position_m[0] = position_m.x();
  landmark.position_m[1] = position_m.y();
  landmark.radius_m = radius_m;
  landmark.kind = static_cast<std::int8_t>(kind);
  return landmark;
}

}  // namespace

bool is_sensor_world(std::string_view world) {
  return std::ranges::find(kSensorWorlds, world, &SensorWorld::name) != kSensorWorlds.end() ||
         world.starts_with(kPoles);
}

std::vector<std::string> sensor_worlds() {
  std::vector<std::string> names;
  names.reserve(kSensorWorlds.size());
  for (const SensorWorld& world : kSensorWorlds) names.emplace_back(world.name);
  return names;
}

std::vector<std::string> lidar_names() {
  std::vector<std::string> names;
  names.reserve(kLasers.size() + 1);
  for (const Laser& laser : kLasers) names.emplace_back(laser.name);
  names.emplace_back(kNoLaser);
  return names;
}

sim::SensorDrive make_sensor_drive(const SensorSimulationOptions& options) {
  sim::SensorSuite suite;
  suite.lidar = lidar_of(options.lidar);
  if (options.planar_laser) {
    suite.planar_laser.emplace();
    suite.planar_laser->revolution_s = options.planar_revolution_s;
  }
  if (options.gnss_outage_from_s) suite.gnss->outages = {{*options.gnss_outage_from_s, 1e9}};
  sim::SpeedParameters speed;
  speed.cruise_mps = options.speed_mps;
  speed.standstill_s = options.standstill_s;
  return {scenario_of(options), speed, std::move(suite), options.seed};
}

void SensorPublisher::publish(const sim::SensorReading& reading) {
  const auto send = [&](const std::string& channel, auto message) {
    message.utime += utime_of_start_;
    publish_(channel, message.utime, wire::encode_message(message));
  };

  if (const auto* pose = std::get_if<sim::TruePose>(&reading)) {
    ground_truth_t truth{};
    truth.utime = pose->utime;
    truth.seq = static_cast<std::int64_t>(pose->sequence);
    truth.world_T_vehicle = wire::to_wire(pose->state.world_T_level());
    send("GROUND_TRUTH", truth);
  } else if (const auto* imu = std::get_if<model::ImuSample>(&reading)) {
    send("RAW_IMU", *imu);
  } else if (const auto* wheels = std::get_if<model::WheelSample>(&reading)) {
    send("RAW_WHEELS", *wheels);
  } else if (const auto* fix = std::get_if<model::GnssFix>(&reading)) {
    send("RAW_GNSS", *fix);
  } else if (const auto* scan = std::get_if<sim::SimulatedPlanarScan>(&reading)) {
    send("RAW_SCAN", scan->scan);
  } else if (const auto* sweep = std::get_if<sim::SimulatedSweep>(&reading)) {
    for (model::PointSweep& part : split_sweep(sweep->raw, kPointsPerMessage)) {
      part.sequence = sweep_parts_++;
      send("RAW_SWEEP", std::move(part));
    }
  }
}

model::Utime complete_at(const sim::SensorReading& reading, const sim::SensorDrive& drive) {
  return std::visit(
      [&](const auto& value) -> model::Utime {
        using Value = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<Value, sim::SimulatedSweep>) {
          const double revolution_s = drive.suite().lidar->revolution_s();
          return static_cast<model::Utime>(1e6 * revolution_s *
                                           static_cast<double>(value.raw.revolution + 1));
        } else if constexpr (std::is_same_v<Value, sim::SimulatedPlanarScan>) {
          return value.scan.end();
        } else {
          return value.utime;
        }
      },
      reading);
}

truth_landmarks_t true_landmarks_on_path(const sim::SensorDrive& drive) {
  const sim::PointGrid path(drive.route().places(1.0), 20.0);
  truth_landmarks_t message{};
  const auto trunks = drive.world().trunks();

  for (std::size_t i = 0; i < trunks.size(); ++i) {
    const Eigen::Vector2d position = trunks[i].centre_m.head<2>();
    if (!path.any_within(position, kLandmarkReach)) continue;
    message.landmarks.push_back(
        truth_landmark(i, position, trunks[i].radius_m, model::LandmarkKind::kTrunk));
  }

  const auto corners = drive.world().corners();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!path.any_within(corners[i].position_m, kLandmarkReach)) continue;
    message.landmarks.push_back(truth_landmark(trunks.size() + i, corners[i].position_m, 0.0,
                                               model::LandmarkKind::kCorner));
  }

  message.num_landmarks = static_cast<std::int32_t>(message.landmarks.size());
  return message;
}

void send_readings(sim::SensorDrive& drive, const Publish& publish,
                   const std::function<void(model::Utime)>& wait_until,
                   model::Utime utime_of_start) {
  truth_landmarks_t landmarks = true_landmarks_on_path(drive);
  landmarks.utime = utime_of_start;
  publish("TRUTH_LANDMARKS", landmarks.utime, wire::encode_message(landmarks));
  SensorPublisher publisher(publish, utime_of_start);
  while (const auto reading = drive.next()) {
    terminal::throw_if_interrupted();
    wait_until(complete_at(*reading, drive));
    publisher.publish(*reading);
  }
}

void write_sensor_log(sim::SensorDrive& drive, const std::string& file,
                      const std::function<void(double)>& progress) {
  OriginalLog writer(file, "understory sim");
  // A log's events are in the order of their stamps: stamps of sweeps are before the time of
  // sending.
  model::Utime now = 0;
  send_readings(
      drive,
      [&](const std::string& channel, model::Utime /*utime*/, const wire::Bytes& bytes) {
        writer.write(now, channel, bytes);
      },
      [&](model::Utime complete) {
        now = complete;
        progress(1e-6 * static_cast<double>(complete));
      });
  writer.commit();
}

}  // namespace understory::cli
