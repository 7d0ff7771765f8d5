// Time of one turn through the landmark extractor, in a wood of 60 trunks within 25 m.
//   bench_landmark_extractor --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
#include "services/landmark_extractor/landmark_extractor.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "tests/landmark_extractor/simulated_space.hpp"

using namespace understory;

namespace {

model::PointSweep turn_in_a_wood(int rings, int columns) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-22.0, 22.0);
  std::uniform_real_distribution<double> radii(0.06, 0.35);
  test::Space space;
  while (space.stems.size() < 60) {
    const Eigen::Vector2d at(place(random), place(random));
    if (at.norm() > 2.5) space.stems.push_back({at, radii(random), {0.02, -0.01}, 0.01});
  }
  space.facades.push_back({{24.0, -10.0}, {24.0, 10.0}, 6.0});
  test::Spinner spinner = test::spinner_of(rings);
  spinner.columns = columns;
  return test::sweep(space, spinner, random);
}

double processor_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// p99_ms is of this thread's own time: other work on the machine does not count.
void extract_revolution(benchmark::State& state) {
  const model::PointSweep turn =
      turn_in_a_wood(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  landmark_extractor::LandmarkExtractor extractor;
  std::vector<double> times_ms;
  std::size_t found = 0;
  for (auto _ : state) {
    const double before = processor_ms();
    found = extractor.extract(turn).detections.size();
    times_ms.push_back(processor_ms() - before);
  }
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["p99_ms"] = times_ms[99 * (times_ms.size() - 1) / 100];
  state.counters["points"] = static_cast<double>(turn.points.size());
  state.counters["landmarks"] = static_cast<double>(found);
}
BENCHMARK(extract_revolution)
    ->ArgNames({"rings", "columns"})
    ->Args({16, 1800})
    ->Args({32, 2048})
    ->Args({64, 2048})
    ->Unit(benchmark::kMillisecond);

}  // namespace
