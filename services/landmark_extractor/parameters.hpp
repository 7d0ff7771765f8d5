#pragma once

#include "common/geometry/se2.hpp"

namespace understory {

/// Trunks from lasers that sweep one plane. Noise figures: SICK LMS 2xx at 0.5 degrees.
struct PlanarTrunkParameters {
  SE2 vehicle_T_sensor;             ///< Where the laser is in frame `vehicle`.
  double min_range_m = 1.5;         ///< What is nearer is the car itself.
  double max_range_m = 40.0;        ///< Trunks farther than this are not reported.
  double range_sigma_m = 0.03;      ///< Of one beam.
  double beam_width_rad = 0.001;    ///< By how much a beam's footprint widens a trunk on each side.
  double roundness_sigma_m = 0.03;  ///< Of the bark from a circle.
  /// How far the centre as seen from one side is off: trunks lean and are no cylinders. ...
  double shape_sigma_m = 0.08;
  /// ... It stays the same over about so many scans, and is counted as white noise of the same
  /// power: what averages over that many detections or more stays honest.
  double shape_correlation_scans = 8.0;
  double min_radius_m = 0.02;
  double max_radius_m = 0.8;
  double prior_radius_m = 0.15;  ///< What a trunk's radius is before it is measured.
  double prior_radius_sigma_m = 0.15;
  double break_distance_m = 0.35;  ///< Neighbouring returns farther apart are two objects...
  double break_per_range = 0.01;   ///< ... plus this much per metre of range.
  double clearance_m = 1.0;        ///< What stands beside a trunk must be so much farther away.
  double separation_m = 2.0;       ///< A trunk's distance to any other object; bushes have less.
  double line_tolerance_m = 0.25;  ///< What is so near the line between its neighbours is a wall.
  int min_points = 1;
  double max_mean_square_residual = 6.0;  ///< Of the ranges from the fitted circle, in sigma^2.
};

struct LandmarkExtractorParameters {
  PlanarTrunkParameters planar;
};

}  // namespace understory
