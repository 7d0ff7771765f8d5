// All services of a LIDAR vehicle on one bus in one process, each behind a bus that can be late.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/bus/config_file.hpp"
#include "common/bus/launch_config.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"
#include "tests/bus/faulty_bus.hpp"
#include "tests/bus/late_bus.hpp"

namespace understory::test {

/// A raw message, and when it is complete [s of the drive].
struct TapeEntry {
  double at_s = 0.0;
  eval::harness::RawMessage message;
};

/// Where and when a short simulated drive takes place.
struct ShortDrive {
  std::uint64_t seed = 1;
  double length_m = 60.0;
  double standstill_s = 3.0;
  model::Utime begins_at = 0;
};

/// The raw messages of a drive through a forest with a VLP-16, an IMU and wheels, in their order.
/// `truth` gets the true poses.
inline std::vector<TapeEntry> record(const ShortDrive& short_drive,
                                     std::vector<eval::metrics::StampedPose>* truth = nullptr) {
  sim::ForestScenarioParameters forest;
  forest.length_m = short_drive.length_m;
  sim::SpeedParameters speed;
  speed.standstill_s = short_drive.standstill_s;
  sim::SensorSuite suite;
  suite.gnss.reset();
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 600;
  sim::SensorDrive drive(sim::forest_scenario(forest, short_drive.seed), sim::VehicleParameters{},
                         speed, suite, short_drive.seed, short_drive.begins_at);

  std::vector<TapeEntry> tape;
  std::uint64_t sweep_parts = 0;
  double now_s = 0.0;
  while (const auto reading = drive.next()) {
    if (const auto* pose = std::get_if<sim::TruePose>(&*reading)) {
      now_s = 1e-6 * static_cast<double>(pose->utime - short_drive.begins_at);
      if (truth != nullptr) truth->push_back({pose->utime, pose->state.world_T_level()});
    }
    if (const auto* sample = std::get_if<model::ImuSample>(&*reading))
      now_s = 1e-6 * static_cast<double>(sample->utime - short_drive.begins_at);
    for (auto& message : eval::harness::raw_messages(*reading, sweep_parts))
      tape.push_back({now_s, std::move(message)});
  }
  return tape;
}

/// What is wrong all the time with the bus of a LateChain, and its computer.
struct Surroundings {
  test::FaultPlan faults = {};  ///< Of every process, and of the sensors.
  std::uint64_t seed = 1;
  bus::Clock clock = bus::no_clock();
};

/// The services of `config/lidar`, and what they have said.
class LateChain {
 public:
  explicit LateChain(const Surroundings& surroundings = {})
      : bus_(bus::MemoryBus::Queues::kUnlimited,
             [this](const bus::BusMessage& message) { hear(message); }),
        faulty_sensors_(bus_, surroundings.faults, surroundings.seed),
        sensors_(faulty_sensors_) {
    const std::filesystem::path config = UNDERSTORY_SOURCE_CONFIG "/lidar";
    for (const bus::Service& service : eval::harness::services_of(config)) {
      const std::filesystem::path file = bus::config_file_in(config, service.name);
      Hosted& hosted = hosted_[service.name];
      hosted.faulty = std::make_unique<test::FaultyBus>(bus_, surroundings.faults,
                                                        surroundings.seed + hosted_.size());
      hosted.bus = std::make_unique<test::LateBus>(*hosted.faulty);
      hosted.service = std::make_unique<bus::HostedService>(
          service, *hosted.bus, surroundings.clock, file.empty() ? "" : bus::read_config_file(file),
          file.string());
      hosted.service->node().connect();
      for (const std::string& channel : hosted.service->node().outputs()) outputs_.insert(channel);
    }
  }

  /// Hands a raw message in, and out all that follows from it.
  void feed(const eval::harness::RawMessage& message) {
    sensors_.publish(message.channel, message.bytes);
    bus_.drain();
  }
  /// The sensors' side of the bus.
  test::LateBus& sensors() { return sensors_; }
  /// A service's side of the bus. Throws std::out_of_range for an unknown name.
  test::LateBus& bus_of(const std::string& service) { return *hosted_.at(service).bus; }
  /// What was late comes, and all that follows from it.
  void go_on() {
    sensors_.go_on();
    for (auto& [name, hosted] : hosted_) hosted.bus->go_on();
    bus_.drain();
  }
  void finish() {
    for (auto& [name, hosted] : hosted_) {
      hosted.service->adapter().finish();
      bus_.drain();
    }
  }

  /// HEALTH of a service as of now. Throws std::out_of_range for an unknown name.
  health_t health_of(const std::string& service) {
    return hosted_.at(service).service->node().health();
  }
  std::set<std::string> services() const {
    std::set<std::string> names;
    for (const auto& [name, hosted] : hosted_) names.insert(name);
    return names;
  }
  /// Of each output, the hash of each message in order.
  const std::map<std::string, std::vector<std::size_t>>& said() const { return said_; }
  std::vector<model::SlamPose> slam;
  std::vector<model::EkfPose> ekf;

 private:
  struct Hosted {
    std::unique_ptr<test::FaultyBus> faulty;
    std::unique_ptr<test::LateBus> bus;
    std::unique_ptr<bus::HostedService> service;
  };

  void hear(const bus::BusMessage& message) {
    if (!outputs_.contains(message.channel)) return;
    const std::string_view bytes(reinterpret_cast<const char*>(message.bytes.data()),
                                 message.bytes.size());
    said_[std::string(message.channel)].push_back(std::hash<std::string_view>{}(bytes));
    if (message.channel == "SLAM_POSE")
      slam.push_back(*wire::decode_message<model::SlamPose>(message.bytes));
    if (message.channel == "EKF_POSE")
      ekf.push_back(*wire::decode_message<model::EkfPose>(message.bytes));
  }

  bus::MemoryBus bus_;
  test::FaultyBus faulty_sensors_;
  test::LateBus sensors_;
  std::map<std::string, Hosted> hosted_;
  std::set<std::string, std::less<>> outputs_;
  std::map<std::string, std::vector<std::size_t>> said_;
};

}  // namespace understory::test
