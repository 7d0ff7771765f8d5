// The smoother at one moment of a run beside the batch solution of that moment.
#pragma once

#include <vector>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

namespace understory::eval::experiments::backend {

/// How far estimates are from where the batch solver has them.
struct Distance {
  double sigma = 0.0;  ///< Mahalanobis, by the estimate's own marginal covariance.
  double m = 0.0;      ///< Of the positions.
};

/// One moment of a run.
struct Moment {
  int poses = 0;
  double chi2 = 0.0;
  double chi2_batch = 0.0;
  bool is_verified = false;        ///< The batch solver converged.
  Distance newest;                 ///< Of the newest pose.
  std::vector<double> seen_sigma;  ///< Distance::sigma of what it shares a factor with.
};

/// Solves the graph of this moment by Levenberg-Marquardt from the smoother's estimates and
/// compares. The smoother goes on as if it had not been asked. O(graph).
Moment moment_of(factor_graph::bayes_tree::IncrementalSmoother& smoother,
                 factor_graph::graph::VariableId newest, int poses);

}  // namespace understory::eval::experiments::backend
