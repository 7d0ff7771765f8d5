#include "eval/experiments/backend/backend_batch.hpp"

#include <algorithm>
#include <vector>

#include "common/factor_graph/batch/sparse_cholesky.hpp"
#include "eval/experiments/backend/backend_feeder.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::backend {
namespace {

constexpr double kBatchDecrease = 1e-10;
constexpr int kTimings = 3;

}  // namespace

factor_graph::graph::FactorGraph copy_of(const factor_graph::graph::FactorGraph& from) {
  factor_graph::graph::FactorGraph graph;
  for (int v = 0; v < from.variable_capacity(); ++v) {
    graph.add(from.type(factor_graph::graph::VariableId(v)),
              from.value(factor_graph::graph::VariableId(v)));
  }

  for (int f = 0; f < from.factor_capacity(); ++f) {
    factor_graph::graph::Factor factor;
    factor.kind = from.kind(factor_graph::graph::FactorId(f));
    const auto variables = from.variables_of(f);
    factor.variable_count = static_cast<int>(variables.size());
    for (std::size_t i = 0; i < variables.size(); ++i) {
      factor.variables[i] = factor_graph::graph::VariableId(variables[i]);
    }
    const auto measurement = from.measurement(factor_graph::graph::FactorId(f));
    std::copy(measurement.begin(), measurement.end(), factor.measurement.begin());
    factor.information = from.information(factor_graph::graph::FactorId(f));
    graph.add(factor);
  }
  return graph;
}

factor_graph::batch::BatchReport solve_whole(factor_graph::graph::FactorGraph& graph) {
  factor_graph::batch::BatchParameters parameters;
  parameters.relative_decrease = kBatchDecrease;
  return optimise(graph, parameters);
}

double solve_from_odometry(const factor_graph::files::GraphFile& file) {
  factor_graph::bayes_tree::IncrementalSmoother never_updated;
  Feeder feeder(file);
  for (std::size_t k = 0; k < feeder.poses(); ++k) feeder.feed(k, never_updated);
  factor_graph::graph::FactorGraph graph = copy_of(never_updated.graph());
  return solve_whole(graph).chi2;
}

double refactorisation_ms(const factor_graph::graph::FactorGraph& from) {
  factor_graph::graph::FactorGraph graph = copy_of(from);
  const factor_graph::batch::SymmetricSparse hessian = factor_graph::batch::hessian_of(graph);
  factor_graph::batch::SparseCholesky cholesky;
  cholesky.factorise(hessian);  // orders it

  double least = 0.0;
  for (int i = 0; i < kTimings; ++i) {
    const double begin = tools::thread_time_s();
    cholesky.factorise(hessian);
    const double ms = 1e3 * (tools::thread_time_s() - begin);
    least = i == 0 ? ms : std::min(least, ms);
  }
  return least;
}

}  // namespace understory::eval::experiments::backend
