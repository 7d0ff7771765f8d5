// The accuracy of a recorded run as JSON and as a table.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "deploy/cli/drive_accuracy.hpp"

namespace understory::cli {

/// The numbers of a run without its series. Keys: deploy/cli/accuracy.md. A measure without data
/// (too short a path, no covariance) is null.
nlohmann::ordered_json accuracy_summary(const DriveAccuracy& accuracy);

/// Prints the result of accuracy_summary(), grouped, with units.
void print_accuracy(const nlohmann::ordered_json& summary);

}  // namespace understory::cli
