// Parts of `understory log` in files of their own.
#pragma once

#include <string>

namespace understory::cli {

/// Options of `understory log accuracy`.
struct AccuracyOptions {
  std::string json_file;         ///< Empty = none.
  double truth_sigma_m = 0.0;    ///< Sigma of GROUND_TRUTH, per axis.
  double truth_sigma_deg = 0.0;  ///< Sigma of its heading.
};

/// Prints the accuracy of the run in `file`; with a JSON file also writes it there with the series
/// for plots. Throws LogError and Interrupted.
void log_accuracy(const std::string& file, const AccuracyOptions& options);

/// Options of `understory log record`.
struct RecordOptions {
  std::string lcm_url;
  std::string channels;  ///< Regular expression; empty = all.
  bool sweeps = false;   ///< Also record the group of the sweeps.
  bool force = false;    ///< An existing file is overwritten.
};

/// Records the bus into `file` until SIGINT or SIGTERM, then prints the amount. The file exists
/// from the start and is complete up to the last second in any case. Throws LogError, BusError.
void log_record(const std::string& file, const RecordOptions& options);

}  // namespace understory::cli
