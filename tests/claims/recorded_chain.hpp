// All messages between the services on one simulated drive, in the order in which they were
// published.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "common/wire/convert.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"

namespace understory::test {

struct RecordedMessage {
  std::string channel;
  wire::Bytes bytes;

  bool operator==(const RecordedMessage&) const = default;
};
using Recording = std::vector<RecordedMessage>;

inline std::string read_toml(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Feeds raw messages to services on one bus; the recording has both and all that followed.
class RecordingChain {
 public:
  /// `config_dir` has NAME.toml for each service.
  RecordingChain(const std::vector<bus::Service>& services,
                 const std::filesystem::path& config_dir) {
    for (const bus::Service& service : services) {
      const std::filesystem::path file = config_dir / (service.name + ".toml");
      hosted_.push_back(std::make_unique<bus::HostedService>(service, bus_, bus::no_clock(),
                                                             read_toml(file), file.string()));
      hosted_.back()->node().connect();
    }
  }
  void feed(const std::string& channel, const wire::Bytes& bytes) {
    bus_.publish(channel, bytes);
    bus_.drain();
  }
  Recording take() { return std::move(recording_); }

 private:
  Recording recording_;
  bus::MemoryBus bus_{bus::MemoryBus::Queues::kUnlimited, [this](const bus::BusMessage& message) {
                        recording_.push_back({std::string(message.channel),
                                              {message.bytes.begin(), message.bytes.end()}});
                      }};
  std::vector<std::unique_ptr<bus::HostedService>> hosted_;
};

/// The six services from raw sensors to the map, `length_m` through a forest.
inline Recording record_lidar_drive(double length_m, std::uint64_t seed) {
  sim::ForestScenarioParameters forest;
  forest.length_m = length_m;
  sim::SensorSuite suite;
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 900;
  sim::SensorDrive drive(sim::forest_scenario(forest, seed), sim::SpeedParameters{}, suite, seed);

  RecordingChain chain(eval::harness::front_end_services(), UNDERSTORY_SOURCE_CONFIG "/lidar");
  std::uint64_t sweep_parts = 0;
  while (const auto reading = drive.next()) {
    for (const auto& message : eval::harness::raw_messages(*reading, sweep_parts))
      chain.feed(message.channel, message.bytes);
  }
  return chain.take();
}

}  // namespace understory::test
