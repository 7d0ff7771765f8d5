#include "eval/experiments/backend/backend.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "eval/experiments/backend/backend_batch.hpp"
#include "eval/experiments/backend/backend_feeder.hpp"
#include "eval/tools/memory.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::backend {
namespace {

using factor_graph::bayes_tree::IncrementalSmoother;
using factor_graph::graph::VariableId;

/// Number of the newest pose among the smoother's variables.
VariableId newest_pose(const IncrementalSmoother& smoother) {
  int newest = smoother.graph().variable_capacity() - 1;
  const auto is_point = [&](int v) {
    const auto type = smoother.graph().type(VariableId(v));
    return type == factor_graph::graph::VariableType::kPoint2 ||
           type == factor_graph::graph::VariableType::kPoint3;
  };
  while (newest > 0 && is_point(newest)) --newest;
  return VariableId(newest);
}

/// True for the updates after which a batch solver looks; of the last in any case.
bool is_checkpoint(std::size_t k, std::size_t poses) {
  constexpr std::size_t kCheckpoints = 50;
  return k + 1 == poses || (k + 1) * kCheckpoints / poses != k * kCheckpoints / poses;
}

/// Pose by pose, with the moments at which a batch solver looks.
void run_updates(Feeder& feeder, IncrementalSmoother& smoother, BackendRun& run) {
  for (std::size_t k = 0; k < feeder.poses(); ++k) {
    const double begin = tools::thread_time_s();
    feeder.feed(k, smoother);
    const factor_graph::bayes_tree::IncrementalUpdate update = smoother.update();
    run.update_ms.push_back(1e3 * (tools::thread_time_s() - begin));
    if (!update.ok && run.error.empty()) run.error = update.error;
    if (is_checkpoint(k, feeder.poses())) {
      run.moments.push_back(moment_of(smoother, newest_pose(smoother), static_cast<int>(k) + 1));
    }
  }
}

/// One fresh factorisation, and batch solvers from here, from dead reckoning and from the chordal
/// initialisation.
void run_references(const factor_graph::files::GraphFile& graph, IncrementalSmoother& smoother,
                    BackendRun& run) {
  const double before = tools::thread_time_s();
  const int iterations = std::max(1, smoother.update_everything().iterations);
  run.whole_ms = 1e3 * (tools::thread_time_s() - before) / iterations;
  run.refactorisation_ms = refactorisation_ms(smoother.graph());

  factor_graph::graph::FactorGraph copy = copy_of(smoother.graph());
  const factor_graph::batch::BatchReport report = solve_whole(copy);
  run.chi2_batch = report.chi2;
  if (!report.ok) run.error = "batch: " + report.error;

  run.chi2_odometry = solve_from_odometry(graph);
  run.chi2_chordal = solve_from_chordal(smoother.graph());
}

}  // namespace

BackendRun run_backend(const std::filesystem::path& file) {
  return run_backend(read_graph_file(file), file.stem().string());
}

BackendRun run_backend(const factor_graph::files::GraphFile& graph, const std::string& dataset) {
  BackendRun run;
  run.dataset = dataset;
  run.factors = graph.factors.size();
  if (const auto untied = find_untied(graph)) throw std::runtime_error(untied->what);
  Feeder feeder(graph);
  run.poses = feeder.poses();
  run.points = graph.vertices.size() - run.poses;

  const auto smoother = std::make_unique<IncrementalSmoother>();
  run_updates(feeder, *smoother, run);
  run.rss_mb = tools::resident_mb();

  const double begin = tools::thread_time_s();
  smoother->settle();
  run.settle_ms = 1e3 * (tools::thread_time_s() - begin);
  run.chi2_final = smoother->graph().chi2();

  run_references(graph, *smoother, run);
  return run;
}

}  // namespace understory::eval::experiments::backend
