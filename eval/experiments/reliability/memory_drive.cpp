#include "eval/experiments/reliability/memory_drive.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/chain_drive.hpp"

namespace understory::eval::experiments::reliability {
namespace {

double arrival_s(const SensorTape::Entry& entry, std::span<const Fault> faults) {
  for (const Fault& fault : faults) {
    const bool is_within = entry.at_s >= fault.from_s && entry.at_s < fault.to_s;
    if (is_within && std::ranges::count(fault.held_channels, entry.message.channel) > 0)
      return fault.to_s;
  }
  return entry.at_s;
}

/// HEALTH is not heard: no pose counts as one that was said to be right.
SaidPose without_health(SaidPose pose) {
  pose.is_ok = false;
  return pose;
}

/// The messages in the order in which they arrive.
std::vector<const harness::RawMessage*> arriving(const SensorTape& tape,
                                                 std::span<const Fault> faults) {
  std::vector<std::pair<double, const harness::RawMessage*>> timed;
  timed.reserve(tape.entries.size());
  for (const SensorTape::Entry& entry : tape.entries)
    timed.emplace_back(arrival_s(entry, faults), &entry.message);
  std::ranges::stable_sort(timed, {}, [](const auto& one) { return one.first; });

  std::vector<const harness::RawMessage*> messages;
  messages.reserve(timed.size());
  for (const auto& one : timed) messages.push_back(one.second);
  return messages;
}

}  // namespace

LiveDrive play_in_memory(const SensorTape& tape, std::span<const Fault> faults,
                         const std::filesystem::path& config_dir) {
  LiveDrive drive;
  drive.not_ok.resize(faults.size());
  harness::SensorChain chain(harness::services_of(config_dir), config_dir);
  chain.watch<model::SlamPose>("SLAM_POSE", [&](const model::SlamPose& pose) {
    if (const auto said = said_pose(pose)) drive.slam.push_back(without_health(*said));
  });
  chain.watch<model::EkfPose>("EKF_POSE", [&](const model::EkfPose& pose) {
    drive.filter.push_back(without_health(said_pose(pose)));
  });

  for (const harness::RawMessage* message : arriving(tape, faults)) {
    terminal::throw_if_interrupted();
    chain.feed(*message);
  }
  chain.finish();
  return drive;
}

}  // namespace understory::eval::experiments::reliability
