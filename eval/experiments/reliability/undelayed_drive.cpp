#include "eval/experiments/reliability/undelayed_drive.hpp"

#include "common/terminal/interrupt.hpp"
#include "eval/harness/chain_drive.hpp"

namespace understory::eval::experiments::reliability {

LiveDrive play_undelayed(const SensorTape& tape, std::size_t faults,
                         const std::filesystem::path& config_dir) {
  LiveDrive drive;
  drive.not_ok.resize(faults);
  harness::SensorChain chain(harness::services_of(config_dir), config_dir);
  chain.watch<model::SlamPose>("SLAM_POSE", [&](const model::SlamPose& pose) {
    if (const auto said = said_pose(pose)) drive.slam.push_back(*said);
  });
  chain.watch<model::EkfPose>(
      "EKF_POSE", [&](const model::EkfPose& pose) { drive.filter.push_back(said_pose(pose)); });

  for (const SensorTape::Entry& entry : tape.entries) {
    terminal::throw_if_interrupted();
    chain.feed(entry.message);
  }
  chain.finish();
  return drive;
}

}  // namespace understory::eval::experiments::reliability
