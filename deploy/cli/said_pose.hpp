// A pose on the command line, with its standard deviations.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "common/geometry/se2.hpp"

namespace understory::cli {

/// A relative pose; all three values or none.
struct SaidPose {
  std::optional<double> x_m;
  std::optional<double> y_m;
  std::optional<double> theta_deg;
  double sigma_m = 0.1;
  double sigma_deg = 0.5;

  /// Whether a pose was given.
  bool is_given() const { return x_m.has_value(); }
  /// Precondition: is_given().
  geometry::SE2WithCovariance pose() const;
};

/// --x-m, --y-m, --theta-deg and --PREFIXsigma-m, --PREFIXsigma-deg. `what`: object and frame of
/// the pose; the options refer to `pose`. A value that is not finite is wrong usage.
void add_said_pose(CLI::App& command, SaidPose& pose, const std::string& what,
                   const std::string& prefix = "");

}  // namespace understory::cli
