// Batch solutions that the smoother is compared with.
#pragma once

#include <optional>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/files/graph_file.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::eval::experiments::backend {

/// The same variables (with the same numbers), estimates and measurements in a graph of its own.
/// Of graphs from which nothing was removed. O(graph).
factor_graph::graph::FactorGraph copy_of(const factor_graph::graph::FactorGraph& from);

/// Levenberg-Marquardt from the graph's estimates, until a step gains less than 1e-10 of chi^2.
factor_graph::batch::BatchReport solve_whole(factor_graph::graph::FactorGraph& graph);

/// chi^2 of the batch solution from dead reckoning: the graph as its edges place it, pose by pose.
double solve_from_odometry(const factor_graph::files::GraphFile& file);

/// chi^2 of the batch solution from the chordal initialisation (Carlone et al., ICRA 2015):
/// rotations by linear least squares on matrices that need not be rotations, made such by their
/// polar decomposition, then positions by linear least squares. It knows nothing of the graph's
/// estimates but the first pose's. None where a factor is neither a relative pose nor a point.
std::optional<double> solve_from_chordal(const factor_graph::graph::FactorGraph& from);

/// Processor time of one numerical factorisation of the graph's Hessian by CHOLMOD in a given order
/// (AMD), least of three [ms].
double refactorisation_ms(const factor_graph::graph::FactorGraph& from);

}  // namespace understory::eval::experiments::backend
