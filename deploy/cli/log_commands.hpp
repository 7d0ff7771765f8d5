// Parts of `understory log` that have a file of their own.
#pragma once

#include <string>

namespace understory::cli {

/// Prints the accuracy of the run in `file`; with `json_file` also writes it there with the series
/// that plots need. Throws LogError and Interrupted.
void log_accuracy(const std::string& file, const std::string& json_file);

}  // namespace understory::cli
