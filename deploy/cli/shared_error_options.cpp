#include "deploy/cli/shared_error_options.hpp"

#include <CLI/CLI.hpp>
#include <numbers>

namespace understory::cli {

void add_view_option(CLI::App& command, double& view_rad) {
  command
      .add_option_function<double>(
          "--view-deg",
          [&view_rad](double degrees) { view_rad = 2.0 * std::numbers::pi * (degrees / 360.0); },
          "Width of the field of view, its middle ahead [degrees]")
      ->check(CLI::Range(1.0, 360.0))
      ->default_str("360");
}

void add_shared_error_options(CLI::App& command, sim::SharedErrorParameters& shared) {
  const auto add = [&](const char* name, double& value, const char* text, double low, double high) {
    command.add_option(name, value, text)
        ->check(CLI::Range(low, high))
        ->capture_default_str()
        ->group("Errors that detections share");
  };
  add("--along-noise", shared.along_sigma_m,
      "Standard deviation per axis of a landmark's error that is correlated along the path [m]",
      0.0, 5.0);
  add("--along-length", shared.along_length_m,
      "Path length after which this error is uncorrelated [m]", 1e-3, 1e5);
  add("--direction-noise", shared.direction_sigma_m,
      "Standard deviation per axis of a landmark's error that depends on the direction from which "
      "it is viewed [m]",
      0.0, 5.0);
  command
      .add_option("--direction-harmonics", shared.direction_harmonics,
                  "Harmonics of this error: its correlation at an angle a is the mean of cos(k a)")
      ->check(CLI::Range(1, 100))
      ->capture_default_str()
      ->group("Errors that detections share");
  add("--radial-bias", shared.radial_bias_share,
      "Error of the range as a share of the range; < 0: landmarks are detected too near", -0.5,
      0.5);
  add("--bearing-bias", shared.bearing_bias_rad,
      "Error of the bearing [rad], times the sine of the bearing", -1.0, 1.0);
  add("--level-noise", shared.level_sigma_rad,
      "Standard deviation of roll and of pitch after levelling [rad]", 0.0, 0.5);
  add("--level-length", shared.level_length_m,
      "Path length after which roll and pitch are uncorrelated [m]", 1e-3, 1e5);
  add("--level-height", shared.level_height_m,
      "Height at which errors of roll and pitch displace all detections of a scan [m]", -100.0,
      100.0);
  add("--missed", shared.missed_share, "Share of the landmarks that a drive never detects", 0.0,
      1.0);
}

}  // namespace understory::cli
