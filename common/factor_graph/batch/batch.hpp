// Batch solution of a factor graph: Gauss-Newton, Levenberg-Marquardt, Dogleg, on CHOLMOD.
#pragma once

#include <string>
#include <vector>

#include "common/factor_graph/batch/sparse_cholesky.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::batch {

/// Control of the step.
enum class BatchMethod : std::uint8_t { kGaussNewton, kLevenbergMarquardt, kDogleg };

/// Settings of one solution.
struct BatchParameters {
  BatchMethod method = BatchMethod::kLevenbergMarquardt;
  int max_iterations = 100;  ///< Largest number of factorisations, including refused steps.
  /// Converged when a step lowers chi^2 by less than this fraction.
  double relative_decrease = 1e-9;
  /// First damping of Levenberg-Marquardt, relative to the Hessian's diagonal.
  double first_damping = 1e-6;
  double first_radius = 10.0;  ///< First trust radius of Dogleg [m, rad].
};

/// Result of a solution.
struct BatchReport {
  bool ok = false;         ///< The estimates are determined.
  bool converged = false;  ///< See BatchParameters::relative_decrease.
  int iterations = 0;      ///< Steps tried.
  double chi2 = 0.0;       ///< Sum of losses at the end.
  std::vector<graph::VariableId>
      undetermined;   ///< The first variable that the measurements do not determine.
  std::string error;  ///< Message with its name.
};

/// Moves the graph's estimates to their local optimum; variables without factors stay. After an
/// error the estimates are the last good ones.
BatchReport optimise(graph::FactorGraph& graph, const BatchParameters& parameters = {});

/// The graph's Hessian, linearised at the estimates: the input of a factorisation. Variables
/// without factors are left out. O(graph).
SymmetricSparse hessian_of(graph::FactorGraph& graph);

}  // namespace understory::factor_graph::batch
