// Parts of `understory log` that have a file of their own.
#pragma once

#include <string>

namespace understory::cli {

/// What `understory log accuracy` was asked for.
struct AccuracyOptions {
  std::string json_file;         ///< Empty = none.
  double truth_sigma_m = 0.0;    ///< Of GROUND_TRUTH, per axis.
  double truth_sigma_deg = 0.0;  ///< Of its heading.
};

/// Prints the accuracy of the run in `file`; with a JSON file also writes it there with the series
/// that plots need. Throws LogError and Interrupted.
void log_accuracy(const std::string& file, const AccuracyOptions& options);

/// What `understory log record` was asked for.
struct RecordOptions {
  std::string lcm_url;
  std::string channels;  ///< Regular expression; empty = all.
  bool sweeps = false;   ///< The group of the sweeps, too.
  bool force = false;    ///< An existing file is overwritten.
};

/// Records the bus into `file` until SIGINT or SIGTERM, then prints how much it was. The file is
/// there from the start and complete to the last second whatever happens. Throws LogError,
/// BusError.
void log_record(const std::string& file, const RecordOptions& options);

}  // namespace understory::cli
