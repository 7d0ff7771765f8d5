// The smoother: one pose more, and one loop closed, in graphs of several sizes; covariances.
#include <benchmark/benchmark.h>

#include <memory>
#include <random>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

using namespace understory;

namespace {

constexpr double kInformation = 2500.0;

/// A walk over a grid of streets: revisits are tied to the pose that was there before.
struct Walk {
  explicit Walk(int poses) {
    names.push_back(smoother.add_variable(geometry::SE2()));
    smoother.add(
        prior(names[0], geometry::SE2(), Eigen::Matrix3d(1e6 * Eigen::Matrix3d::Identity())));
    for (int k = 1; k < poses; ++k) step();
  }
  geometry::SE2 noisy(const geometry::SE2& motion) {
    return motion *
           geometry::SE2(0.02 * normal(random), 0.02 * normal(random), 0.02 * normal(random));
  }
  void step() {
    const int k = static_cast<int>(names.size());
    const geometry::SE2 motion(1.0, 0.0, k % 10 == 0 ? 1.5707963 : 0.0);
    const factor_graph::graph::VariableId last = names.back();
    names.push_back(smoother.add_variable(smoother.pose2(last) * motion));
    smoother.add(relative(last, names.back(), noisy(motion),
                          Eigen::Matrix3d(kInformation * Eigen::Matrix3d::Identity())));
    if (k > 40 && k % 7 == 0) close(static_cast<std::size_t>(k) - 40);
    smoother.update();
  }
  /// The walk is periodic in 40 steps: what was there then is here now.
  void close(std::size_t old) {
    smoother.add(relative(names[old], names.back(), noisy(geometry::SE2()),
                          Eigen::Matrix3d(kInformation * Eigen::Matrix3d::Identity())));
  }

  std::mt19937_64 random{1};
  std::normal_distribution<double> normal;
  factor_graph::bayes_tree::IncrementalSmoother smoother;
  std::vector<factor_graph::graph::VariableId> names;
};

void one_more_pose(benchmark::State& state) {
  Walk walk(static_cast<int>(state.range(0)));
  for (auto _ : state) walk.step();
}
BENCHMARK(one_more_pose)->Arg(500)->Arg(5000)->Iterations(2000)->Unit(benchmark::kMicrosecond);

/// A closure to the beginning of the walk, taken back each time.
void close_and_undo(benchmark::State& state) {
  Walk walk(static_cast<int>(state.range(0)));
  const std::size_t begin = (walk.names.size() - 1) % 40;
  for (auto _ : state) {
    walk.smoother.checkpoint();
    walk.close(begin);
    walk.smoother.update();
    walk.smoother.rollback();
  }
}
BENCHMARK(close_and_undo)->Arg(500)->Arg(5000)->Iterations(200)->Unit(benchmark::kMicrosecond);

void covariance_of_the_newest(benchmark::State& state) {
  Walk walk(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(walk.smoother.joint_covariance({&walk.names.back(), 1}));
  }
}
BENCHMARK(covariance_of_the_newest)->Arg(500)->Arg(5000)->Unit(benchmark::kMicrosecond);

}  // namespace
