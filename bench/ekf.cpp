// Time of one scan in the filter: prediction, gates, joint update, outputs.
#include "services/ekf/ekf.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

using namespace understory;

namespace {

/// `count` landmarks on a grid around a vehicle that goes straight on, all seen in every scan.
void one_scan(benchmark::State& state) {
  const int count = static_cast<int>(state.range(0));
  ekf::EkfParameters parameters;
  parameters.map.max_landmarks = 200;
  ekf::Ekf filter(parameters);

  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  model::TrackedScan scan;
  scan.field_of_view.max_range_m = 60.0;

  for (int i = 0; i < count; ++i) {
    model::Detection seen;
    const int column = i % side - side / 2;
    const int row = i / side - side / 2;
    seen.position_m << 5.0 * column, 5.0 * row, 0.0;
    seen.covariance_m2 = 0.01 * Eigen::Matrix3d::Identity();
    scan.landmarks.push_back(
        {static_cast<model::TrackId>(i + 1), static_cast<std::uint32_t>(i), seen});
  }

  model::Odometry increment;
  increment.covariance = 1e-6 * Eigen::Matrix3d::Identity();
  increment.inertial.emplace();
  increment.inertial->seconds = 0.1;
  increment.inertial->covariance = 1e-6 * Eigen::Matrix<double, 5, 5>::Identity();

  std::vector<double> us;
  for (auto _ : state) {
    const auto begin = std::chrono::steady_clock::now();
    filter.add(increment);
    benchmark::DoNotOptimize(filter.add(scan));
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin)
                     .count());
    increment.from_utime = scan.utime;
    increment.utime = scan.utime += 100000;
  }

  state.counters["used"] = static_cast<double>(filter.counters().landmarks_used) /
                           static_cast<double>(filter.counters().scans);
  const auto at = us.begin() + static_cast<std::ptrdiff_t>(us.size() * 99 / 100);
  std::nth_element(us.begin(), at, us.end());
  state.counters["p99 us"] = *at;
}

}  // namespace

BENCHMARK(one_scan)->Arg(20)->Arg(50)->Arg(75)->Arg(100)->Arg(150)->Unit(benchmark::kMicrosecond);
