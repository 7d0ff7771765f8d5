// Parts of `understory log` that have a file of their own.
#pragma once

#include <string>

namespace understory::cli {

/// Prints the accuracy of the run in `file`; with `json_file` also writes it there with the series
/// that plots need. Throws LogError and Interrupted.
void log_accuracy(const std::string& file, const std::string& json_file);

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
