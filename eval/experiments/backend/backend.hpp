// Standard graphs through the smoother, one pose per update.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/factor_graph/files/graph_file.hpp"

namespace understory::eval::experiments::backend {

/// One graph, fed pose by pose: each with all factors to earlier ones.
struct BackendRun {
  std::string dataset;
  std::size_t poses = 0, points = 0, factors = 0;
  std::vector<double> update_ms;  ///< Processor time, estimate included.
  double settle_ms = 0.0;         ///< After the last pose, until all estimates are up to date.
  double whole_ms = 0.0;          ///< One fresh ordering, linearisation and factorisation of all.
  double chi2_final = 0.0;
  double chi2_batch = 0.0;  ///< Levenberg-Marquardt (CHOLMOD) from the final estimates.
  double batch_s = 0.0;
  double chi2_dead_reckoning = 0.0;  ///< The same from dead reckoning: often another minimum.
  double rss_mb = 0.0;               ///< Of the process, at the end of the run.
  double smoother_mb = 0.0;
  std::string error;
};

/// Runs the graph of a file (g2o, TORO or iSAM text) through the smoother and a batch solver.
/// Throws std::runtime_error naming file and line where it is no graph, or not one that its edges
/// hold together; what fails later is in `error`. Lines that were passed over are counted on
/// stderr.
BackendRun run_backend(const std::filesystem::path& file);
/// The same for a graph in memory (std::runtime_error where its edges do not hold it together);
/// `dataset` is its name in the table.
BackendRun run_backend(const factor_graph::files::GraphFile& graph, const std::string& dataset);

}  // namespace understory::eval::experiments::backend
