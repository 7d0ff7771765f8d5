// `understory eval frontend`: from raw sensors to a pose, part by part and as a whole.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "eval/experiments/frontend/frontend_rows.hpp"
#include "eval/harness/chain_drive.hpp"

namespace understory::eval::experiments::frontend {

/// The command line of `understory eval frontend`.
struct FrontendOptions {
  int runs = 10;  ///< Monte-Carlo runs of the filter; a tenth of them of the others.
  std::uint64_t seed = 1;
  int jobs = 1;
  double drive_m = 1000.0;           ///< Of the simulated forest drive.
  std::filesystem::path config_dir;  ///< Of the chain's services.
  std::filesystem::path data;        ///< Recordings.
  std::string json;
  std::vector<std::string> sections;
  bool plots = true;
};

/// Tracks on simulated detections: purity, switches, time.
void add_tracking_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                       FrontendRows& rows);
/// The filter on simulated detections: consistency, drift, time.
void add_filter_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                     FrontendRows& rows);
/// The filter where sway, walk of the biases and noise are not those that it takes them for.
void add_mismatch_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                       FrontendRows& rows);
/// Trunks and corners in simulated sweeps: precision, recall, error, covariance, time.
void add_extraction_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                         FrontendRows& rows);
/// Trunks and corners of a laser with one plane while the vehicle turns: scans taken as they are,
/// de-skewed, and taken at once.
void add_planar_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                     FrontendRows& rows);
/// The chain beside the batch solution of its own measurements with true association.
void add_limit_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                    FrontendRows& rows);
/// Trunks in registered clouds of real forest plots, where the data are there; for the plots too.
void add_forest_plot_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                          FrontendRows& rows, nlohmann::json& traces);
/// Accuracy and time of one drive of the whole chain.
void add_chain_rows(const harness::ChainRun& run, std::optional<double> ate_target_m,
                    FrontendRows& rows);
/// Processor time of each service, as a share of the drive's time and as a quantile per message.
void add_time_rows(const harness::ChainRun& run, FrontendRows& rows);
/// Trajectories and map, for the plots.
nlohmann::json trace_of(const harness::ChainRun& run);
/// Faults of the sensors: what HEALTH counts, and the error of the pose afterwards.
void add_fault_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                    FrontendRows& rows);

}  // namespace understory::eval::experiments::frontend
