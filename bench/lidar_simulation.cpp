// Simulated sweeps: time per revolution, and per ray, in each kind of world.
//   build/release/bench/bench_lidar_simulation
// The vehicle drives; revolutions are taken all along the path.
#include <benchmark/benchmark.h>

#include "sim/scenarios.hpp"

namespace understory::sim {
namespace {

enum World3d { kForest, kDenseForest, kTown, kCountry };

sim::Scenario scenario_of(int world) {
  sim::ForestScenarioParameters forest;
  forest.length_m = 500.0;
  switch (world) {
    case kDenseForest:
      forest.forest = forest_parameters(sim::ForestKind::kDense);
      [[fallthrough]];
    case kForest:
      return forest_scenario(forest, 1);
    case kTown:
      return sim::urban_scenario(1, 1);
    default:
      return sim::countryside_scenario(2000.0, 1);
  }
}

void sweep(benchmark::State& state) {
  sim::SensorSuite suite;
  const bool many_beams = state.range(1) == 64;
  suite.lidar->elevations_rad =
      beam_elevations_rad(many_beams ? sim::LidarModel::kHdl64 : sim::LidarModel::kVlp32);
  suite.lidar->columns = many_beams ? 2048 : 1800;
  sim::SensorDrive drive(scenario_of(static_cast<int>(state.range(0))), sim::SpeedParameters{},
                         suite, 1);
  const double rays =
      static_cast<double>(suite.lidar->elevations_rad.size()) * suite.lidar->columns;
  std::uint64_t revolution = 250;

  std::size_t points = 0;
  for (auto _ : state) {
    const sim::SimulatedSweep simulated = drive.sweep(revolution);
    points += simulated.raw.points.size();
    revolution = revolution + 37 < drive.sweep_count() ? revolution + 37 : 250;
  }

  const auto revolutions = static_cast<double>(state.iterations());
  state.counters["points"] = static_cast<double>(points) / revolutions;
  state.counters["s_per_ray"] = benchmark::Counter(
      revolutions * rays, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(sweep)
    ->ArgNames({"world", "beams"})
    ->ArgsProduct({{kForest, kDenseForest, kTown, kCountry}, {32, 64}})
    ->Unit(benchmark::kMillisecond);

/// Everything but sweeps, per second of driving.
void motion_sensors(benchmark::State& state) {
  const sim::Scenario scenario = scenario_of(kForest);
  sim::SensorSuite suite;
  suite.lidar.reset();
  for (auto _ : state) {
    sim::SensorDrive drive(scenario, sim::SpeedParameters{}, suite, 1);
    while (auto reading = drive.next()) benchmark::DoNotOptimize(reading);
    state.counters["driven_s"] = drive.motion().duration_s();
  }
}
BENCHMARK(motion_sensors)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace understory::sim
