// Standard graphs through the smoother, one pose per update.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "common/factor_graph/files/graph_file.hpp"
#include "eval/experiments/backend/backend_moment.hpp"

namespace understory::eval::experiments::backend {

/// One graph, fed pose by pose: each with all factors to earlier ones.
struct BackendRun {
  std::string dataset;
  std::size_t poses = 0, points = 0, factors = 0;
  std::vector<double> update_ms;  ///< Processor time, estimate included; checkpoints are not.
  std::vector<Moment> moments;    ///< Some 50, evenly spaced; the last one is the end of the run,
                                  ///< before settle().
  double settle_ms = 0.0;         ///< After the last pose, until a fresh step changes nothing.
  double whole_ms = 0.0;          ///< One fresh ordering, linearisation and factorisation of all.
  double refactorisation_ms = 0;  ///< CHOLMOD's numerical factorisation of the last graph.
  double chi2_final = 0.0;        ///< After settle().
  double chi2_batch = 0.0;        ///< Levenberg-Marquardt (CHOLMOD) from the final estimates.
  double chi2_odometry = 0.0;     ///< The same from dead reckoning: often another minimum.
  std::optional<double> chi2_chordal;  ///< The same from the chordal initialisation.
  double rss_mb = 0.0;                 ///< Of the process, at the end of the run.
  std::string error;
};

/// Runs the graph of a file (g2o, TORO or iSAM text) through the smoother and batch solvers. Throws
/// std::runtime_error naming file and line where it is no graph, or not one that its edges hold
/// together; what fails later is in `error`. Lines that were passed over are counted on stderr.
BackendRun run_backend(const std::filesystem::path& file);
/// The same for a graph in memory (std::runtime_error where its edges do not hold it together);
/// `dataset` is its name in the table.
BackendRun run_backend(const factor_graph::files::GraphFile& graph, const std::string& dataset);

}  // namespace understory::eval::experiments::backend
