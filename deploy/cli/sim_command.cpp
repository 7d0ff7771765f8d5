// `understory sim`: a simulated drive with ground truth, onto the bus or into a log.
#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <thread>

#include "common/bus/live_bus.hpp"
#include "common/io/text_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/original_log.hpp"
#include "deploy/cli/sensor_simulation.hpp"
#include "deploy/cli/shared_error_options.hpp"
#include "deploy/cli/sim_changes.hpp"
#include "deploy/cli/sim_stem_frames.hpp"
#include "sim/drive.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::cli {
namespace {

struct SimOptions {
  std::string world;
  std::string out;
  std::string lcm_url;
  std::string path = "circle";
  sim::DriveParameters drive;
  bool wheels = false;
  std::uint64_t seed = 1;
  double rate = 1.0;
  SensorSimulationOptions sensors;
};

sim::Drive make_drive(SimOptions& options) {
  const auto path = sim::path_kind(options.path);
  if (!path) wrong_usage(fmt::format("--path {}: no such path", options.path));
  options.drive.path.kind = *path;
  if (const auto kind = sim::forest_kind(options.world)) {
    options.drive.forest = sim::forest_parameters(*kind);
    return {options.drive, options.seed};
  }
  auto stems = sim::parse_stem_map(io::read_whole_file(options.world));
  if (!stems.error.empty()) fail(fmt::format("{}: {}", options.world, stems.error));
  return {options.drive, std::move(stems.forest), options.seed};
}

/// The trunks that may be detected on the path: no map of the drive can hold others (a given map
/// may), and a whole square kilometre would be a message of half a megabyte.
truth_landmarks_t truth_landmarks(const sim::Drive& drive, model::Utime utime_of_start) {
  std::set<std::uint32_t> in_range;
  for (const auto& pose : drive.world_T_vehicle()) {
    const auto near = drive.grid().within(pose.translation(), drive.reach_m());
    in_range.insert(near.begin(), near.end());
  }

  truth_landmarks_t message{};
  message.utime = utime_of_start;
  for (const auto trunk : in_range) {
    truth_landmark_t landmark{};
    landmark.id = trunk;
    landmark.position_m[0] = drive.forest().trunks_m[trunk].x();
    landmark.position_m[1] = drive.forest().trunks_m[trunk].y();
    landmark.radius_m = drive.forest().radii_m[trunk];
    message.landmarks.push_back(landmark);
  }

  message.num_landmarks = static_cast<std::int32_t>(message.landmarks.size());
  return message;
}

/// Scan k with its truth, and before it the motion up to it where there are wheels.
void publish_scan(const sim::Drive& drive, std::size_t k, bool wheels, model::Utime utime_of_start,
                  const Publish& publish) {
  if (wheels && k > 0) {
    model::Odometry odometry = drive.odometry(k);
    odometry.from_utime += utime_of_start;
    odometry.utime += utime_of_start;
    publish("ODOMETRY", odometry.utime, wire::encode_message(odometry));
  }
  sim::SimulatedScan simulated = drive.scan(k);
  simulated.scan.utime += utime_of_start;

  ground_truth_t truth{};
  truth.utime = simulated.scan.utime;
  truth.seq = static_cast<std::int64_t>(k);
  truth.world_T_vehicle = wire::to_wire(simulated.world_T_vehicle);
  publish("GROUND_TRUTH", truth.utime, wire::encode_message(truth));
  publish("LANDMARKS", simulated.scan.utime, wire::encode_message(simulated.scan));
}

void write_log(const sim::Drive& drive, const SimOptions& options) {
  OriginalLog writer(options.out, "understory sim");
  const Publish publish = [&](const std::string& channel, model::Utime utime,
                              const wire::Bytes& bytes) { writer.write(utime, channel, bytes); };
  terminal::Progress progress("simulating", static_cast<double>(drive.size()));
  publish("TRUTH_LANDMARKS", 0, wire::encode_message(truth_landmarks(drive, 0)));
  for (std::size_t k = 0; k < drive.size(); ++k) {
    terminal::throw_if_interrupted();
    publish_scan(drive, k, options.wheels, 0, publish);
    progress.update(static_cast<double>(k + 1));
  }
  writer.commit();
}

Publish publish_on(bus::Bus& bus) {
  return [&bus](const std::string& channel, model::Utime /*utime*/, const wire::Bytes& bytes) {
    const auto refusal = bus.publish(channel, bytes);
    if (refusal) fail(fmt::format("channel {}: {}", channel, refusal->detail));
  };
}

/// The stamp of now: a live drive is stamped by the computer's clock as real sensors are, so that
/// time goes on for processes that run or keep their state when the simulator is started again.
model::Utime clock_utime() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

void drive_live(const sim::Drive& drive, const SimOptions& options) {
  const auto bus = bus::make_live_bus(options.lcm_url);
  const Publish publish = publish_on(*bus);
  terminal::Progress progress("driving", static_cast<double>(drive.size()),
                              terminal::Progress::Without::kTenths);
  const model::Utime utime_of_start = clock_utime();
  publish("TRUTH_LANDMARKS", utime_of_start,
          wire::encode_message(truth_landmarks(drive, utime_of_start)));
  const auto start = std::chrono::steady_clock::now();

  for (std::size_t k = 0; k < drive.size(); ++k) {
    const double elapsed_us = static_cast<double>(drive.utime(k) - drive.utime(0)) / options.rate;
    std::this_thread::sleep_until(start +
                                  std::chrono::microseconds(static_cast<std::int64_t>(elapsed_us)));
    terminal::throw_if_interrupted();
    publish_scan(drive, k, options.wheels, utime_of_start, publish);
    progress.update(static_cast<double>(k + 1));
  }
}

void send_sensors_live(sim::SensorDrive& drive, const SimOptions& options) {
  const auto bus = bus::make_live_bus(options.lcm_url);
  terminal::Progress progress("driving", drive.motion().duration_s(),
                              terminal::Progress::Without::kTenths);
  const auto start = std::chrono::steady_clock::now();
  const auto wait_until = [&](model::Utime complete) {
    progress.update(1e-6 * static_cast<double>(complete));
    const auto elapsed_us = static_cast<std::int64_t>(static_cast<double>(complete) / options.rate);
    std::this_thread::sleep_until(start + std::chrono::microseconds(elapsed_us));
  };
  send_readings(drive, publish_on(*bus), wait_until, clock_utime());
}

void simulate_sensors(SimOptions& options) {
  options.sensors.world = options.world;
  options.sensors.path = options.path;
  options.sensors.seed = options.seed;
  sim::SensorDrive drive = make_sensor_drive(options.sensors);

  try {
    if (options.out.empty()) {
      send_sensors_live(drive, options);
    } else {
      terminal::Progress progress("simulating", drive.motion().duration_s());
      write_sensor_log(drive, options.out, [&](double done_s) { progress.update(done_s); });
    }
  } catch (const terminal::Interrupted& error) {
    fail(fmt::format("sim: {}", error.what()));
  }

  fmt::print("{:.1f} m driven in {:.1f} s{}{}\n", drive.motion().driven_m(),
             drive.motion().duration_s(), options.out.empty() ? "" : " -> ", options.out);
}

void simulate(SimOptions& options) {
  terminal::catch_interrupts();
  if (is_sensor_world(options.world)) {
    simulate_sensors(options);
    return;
  }

  const auto drive = [&] {
    try {
      return make_drive(options);
    } catch (const std::runtime_error& error) {
      if (dynamic_cast<const CLI::Error*>(&error) != nullptr) throw;
      fail(fmt::format("sim {} --path {}: {}", options.world, options.path, error.what()));
    }
  }();

  try {
    if (options.out.empty()) {
      drive_live(drive, options);
    } else {
      write_log(drive, options);
    }
  } catch (const terminal::Interrupted& error) {
    fail(fmt::format("sim: {}", error.what()));
  }

  const double last_s = 1e-6 * static_cast<double>(drive.utime(drive.size() - 1) - drive.utime(0));
  fmt::print("{} scans in {:.1f} s of driving{}{}\n", drive.size(), last_s,
             options.out.empty() ? "" : " -> ", options.out);
}

/// An option of an older version: refused with the new name in the message.
void refuse_renamed(CLI::App& command, const std::string& old_name, const std::string& new_name) {
  command
      .add_option_function<std::string>(
          old_name,
          [=](const std::string& /*value*/) {
            wrong_usage(fmt::format("{} is now called {}", old_name, new_name));
          },
          "")
      ->group("");  // not in --help
}

void add_landmark_options(CLI::App& command, SimOptions& options) {
  auto& drive = options.drive;
  command.add_option("--length", drive.path.length_m, "Length of the path [m]")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  command
      .add_option("--interval", drive.path.interval,
                  "Interval between scans [m driven or rad rotated]")
      ->check(CLI::Range(1e-3, 100.0))
      ->capture_default_str();
  command.add_option("--speed", drive.speed_mps, "Speed of the vehicle [m/s]")
      ->check(CLI::Range(1e-3, 100.0))
      ->capture_default_str();

  command.add_option("--sensor-range", drive.sensor.range_m, "Range of the sensor [m]")
      ->check(CLI::Range(1.0, 1e3))
      ->capture_default_str();
  command
      .add_option("--detection", drive.sensor.detection_probability,
                  "Probability that a landmark in range is detected")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--noise", drive.sensor.position_sigma_m,
                  "Independent standard deviation of a position per axis [m]")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  add_view_option(command, drive.sensor.view_rad);
  command
      .add_option("--trunks-in-view", drive.trunks_in_view,
                  "Thin the forest to this mean number of trunks in view; 0 = do not thin it")
      ->check(CLI::Range(0.0, 1e4))
      ->capture_default_str();
  command.add_flag("--wheels", options.wheels, "Also give ODOMETRY of wheels between scans");
  add_shared_error_options(command, drive.sensor.shared);
}

void add_sensor_options(CLI::App& command, SimOptions& options) {
  auto& sensors = options.sensors;
  const std::string group = "With sensors";
  command.add_option("--forest", sensors.forest, "Density of the trunks in forest3d")
      ->group(group)
      ->check(CLI::IsMember(sim::forest_names()))
      ->capture_default_str();
  command
      .add_option("--distance", sensors.length_m, "Distance to drive [m]; `urban` has a fixed one")
      ->group(group)
      ->check(CLI::Range(20.0, 2e5))
      ->capture_default_str();
  refuse_renamed(command, "--way", "--distance");
  command.add_option("--laps", sensors.laps, "Laps of the path (forest3d, urban)")
      ->group(group)
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_option("--cruise", sensors.speed_mps, "Speed on straights [m/s]")
      ->group(group)
      ->check(CLI::Range(0.5, 30.0))
      ->capture_default_str();
  command
      .add_option("--standstill", sensors.standstill_s,
                  "Standstill at the start [s]; below 1 s the drive begins with a jolt")
      ->group(group)
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();

  command.add_option("--lidar", sensors.lidar, "Model of the laser")
      ->group(group)
      ->check(CLI::IsMember(lidar_names()))
      ->capture_default_str();
  command.add_flag("--planar-laser", sensors.planar_laser, "Add a one-plane laser")->group(group);
  command
      .add_option("--planar-revolution", sensors.planar_revolution_s,
                  "Time of its revolution [s]; 0 = all beams at one instant")
      ->group(group)
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_option("--gnss-until", sensors.gnss_outage_from_s, "No GNSS after this time [s]")
      ->group(group)
      ->check(CLI::Range(0.0, 1e6));
}

}  // namespace

void add_sim_command(CLI::App& parent) {
  auto* command = parent.add_subcommand(
      "sim", "A simulated drive with ground truth, onto the bus or into a log");
  auto options = std::make_shared<SimOptions>();
  command->add_option(
      "world", options->world,
      fmt::format("Ideal landmarks: {}, or a CSV file with x_m,y_m[,dbh_m]. Sensors: {}, "
                  "poles:POLES.csv,TRAJECTORY.csv",
                  fmt::join(sim::forest_names(), ", "), fmt::join(sensor_worlds(), ", ")));
  command->add_option("--out", options->out, "Write this log instead of sending on the bus");
  command->add_option("--lcm-url", options->lcm_url,
                      "LCM URL of the bus, e.g. udpm://239.255.76.67:7667?ttl=0");
  command
      ->add_option(
          "--path", options->path,
          "Shape of the path (ideal landmarks, forest3d); stationary: only with ideal landmarks")
      ->check(CLI::IsMember(sim::path_names()))
      ->capture_default_str();
  add_landmark_options(*command, *options);

  add_sensor_options(*command, *options);
  command->add_option("--seed", options->seed, "Seed of world, start and noise")
      ->capture_default_str();
  command
      ->add_option("--rate", options->rate, "Live: speed of the drive, as a multiple of real time")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  add_stem_frames_simulation(*command);
  add_changes_simulation(*command);
  command->callback([command, options] {
    if (!command->get_subcommands().empty()) return;
    if (options->world.empty()) throw CLI::RequiredError("world");
    simulate(*options);
  });
}

}  // namespace understory::cli
