// A pose that a person gives on the command line, with its standard deviations.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "common/geometry/se2.hpp"

namespace understory::cli {

/// Of one thing in the frame of another; all three or none.
struct SaidPose {
  std::optional<double> x_m;
  std::optional<double> y_m;
  std::optional<double> theta_deg;
  double sigma_m = 0.1;
  double sigma_deg = 0.5;

  /// Whether one was given.
  bool is_given() const { return x_m.has_value(); }
  /// Precondition: one was given.
  geometry::SE2WithCovariance pose() const;
};

/// --x-m, --y-m, --theta-deg and --PREFIXsigma-m, --PREFIXsigma-deg. `what` says of what in whose
/// frame; the options refer to `pose`. What is not finite is wrong usage.
void add_said_pose(CLI::App& command, SaidPose& pose, const std::string& what,
                   const std::string& prefix = "");

}  // namespace understory::cli
