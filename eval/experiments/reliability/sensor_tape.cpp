#include "eval/experiments/reliability/sensor_tape.hpp"

#include <utility>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::reliability {
SensorTape record_tape(double length_m, std::uint64_t seed) {
  sim::ForestScenarioParameters forest;
  forest.length_m = length_m;
  sim::SensorSuite suite;
  suite.gnss.reset();
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 900;
  sim::SensorDrive drive(sim::forest_scenario(forest, seed), sim::SpeedParameters{}, suite, seed);

  SensorTape tape;
  std::uint64_t sweep_parts = 0;
  double now_s = 0.0;
  while (const auto reading = drive.next()) {
    terminal::throw_if_interrupted();
    // Readings come in the order in which they are complete: a sweep behind the others of its end.
    if (const auto* pose = std::get_if<sim::TruePose>(&*reading)) {
      now_s = 1e-6 * static_cast<double>(pose->utime);
      tape.truth.push_back({pose->utime, pose->state.world_T_level()});
      continue;
    }
    if (const auto* sample = std::get_if<model::ImuSample>(&*reading))
      now_s = 1e-6 * static_cast<double>(sample->utime);
    for (harness::RawMessage& message : harness::raw_messages(*reading, sweep_parts))
      tape.entries.push_back({now_s, std::move(message)});
  }
  return tape;
}

}  // namespace understory::eval::experiments::reliability
