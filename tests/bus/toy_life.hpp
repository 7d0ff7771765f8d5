// A life of the toy service with its state on disk.
#pragma once

#include <filesystem>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "tests/bus/toy_service.hpp"
#include "tests/scratch.hpp"

namespace understory::test {

/// One life of the toy: recovers, takes inputs [from, to), is killed (nothing is saved at the end).
struct Life {
  explicit Life(const std::filesystem::path& directory, const std::string& toml = "",
                const bus::Clock& clock = bus::no_clock(),
                bus::StateStore::Saving saving = bus::StateStore::Saving::kAtOnce)
      : hosted(toy_service(), bus, clock, toml, "toy.toml"), store(directory, "toy", saving) {
    bus.subscribe("RAW_POSE", 0, [this](const bus::BusMessage& message) {
      poses.push_back(*wire::decode_message<raw_pose_t>(message.bytes));
    });
    is_recovered = hosted.node().recover(store);
    hosted.node().journal_to(&store);
    hosted.node().connect();
    bus.drain();
  }
  void run(int from, int to) {
    for (int i = from; i < to; ++i) {
      bus.publish("ODOMETRY", wire::encode_message(toy_input(i)));
      bus.drain();
    }
  }
  bus::MemoryBus bus{bus::MemoryBus::Queues::kUnlimited};
  bus::HostedService hosted;
  bus::StateStore store;
  bool is_recovered = false;
  std::vector<raw_pose_t> poses;
};

/// What a life that nothing happens to publishes for the inputs [0, to).
inline std::vector<raw_pose_t> uninterrupted(int to) {
  const Scratch scratch("state");
  Life life(scratch.path());
  life.run(0, to);
  return life.poses;
}

}  // namespace understory::test
