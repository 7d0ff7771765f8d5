// A factor graph solved whole: Gauss-Newton, Levenberg-Marquardt, Dogleg, on CHOLMOD.
#pragma once

#include <string>
#include <vector>

#include "common/factor_graph/batch/sparse_cholesky.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::batch {

/// How the step is controlled.
enum class BatchMethod : std::uint8_t { kGaussNewton, kLevenbergMarquardt, kDogleg };

/// Settings of one solution.
struct BatchParameters {
  BatchMethod method = BatchMethod::kLevenbergMarquardt;
  int max_iterations = 100;  ///< Factorisations, with those of refused steps.
  /// Converged when a step lowers chi^2 by less than this part of it.
  double relative_decrease = 1e-9;
  double first_damping = 1e-6;  ///< Of Levenberg-Marquardt, relative to the Hessian's diagonal.
  double first_radius = 10.0;   ///< Of Dogleg [m, rad].
};

/// What a solution found.
struct BatchReport {
  bool ok = false;                              ///< The estimates are determined.
  bool converged = false;                       ///< See BatchParameters::relative_decrease.
  int iterations = 0;                           ///< Steps tried.
  double chi2 = 0.0;                            ///< Sum of losses at the end.
  std::vector<graph::VariableId> undetermined;  ///< The first that the measurements leave open.
  std::string error;                            ///< Names it.
};

/// Moves the graph's estimates to the optimum that they lead to; variables without factors stay. On
/// an error the estimates are the last good ones.
BatchReport optimise(graph::FactorGraph& graph, const BatchParameters& parameters = {});

/// The graph's Hessian, linearised at the estimates: what a factorisation works on. Variables
/// without factors are left out. O(graph).
SymmetricSparse hessian_of(graph::FactorGraph& graph);

}  // namespace understory::factor_graph::batch
