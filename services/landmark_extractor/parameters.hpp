// Parameters of the extractor. What each is for, and how sensitive results are: README.md.
#pragma once

namespace understory::landmark_extractor {

/// Trunks from lasers that sweep one plane. Noise figures: SICK LMS 2xx at 0.5 degrees.
struct PlanarTrunkParameters {
  double min_range_m = 1.5;         ///< Nearer returns are of the car itself.
  double max_range_m = 40.0;        ///< Trunks farther than this are not reported.
  double range_sigma_m = 0.03;      ///< Of one beam.
  double beam_width_rad = 0.001;    ///< By how much a beam's footprint widens a trunk on each side.
  double roundness_sigma_m = 0.03;  ///< Deviation of the bark from a circle.
  /// Error of the centre as seen from one side: trunks lean and are no cylinders.
  double shape_sigma_m = 0.08;
  /// That error is correlated over about so many scans, and is counted as white noise of the same
  /// power: averages over that many detections or more have a consistent covariance.
  double shape_correlation_scans = 8.0;
  double min_radius_m = 0.02;          ///< Of a trunk.
  double max_radius_m = 0.8;           ///< Of a trunk.
  double prior_radius_m = 0.15;        ///< A trunk's radius before it is measured.
  double prior_radius_sigma_m = 0.15;  ///< Of the prior.
  double break_distance_m = 0.35;      ///< Neighbouring returns farther apart are two objects...
  double break_per_range = 0.01;       ///< ... plus this much per metre of range.
  double clearance_m = 1.0;            ///< What stands beside a trunk must be so much farther away.
  double separation_m = 2.0;       ///< A trunk's distance to any other object; bushes have less.
  double line_tolerance_m = 0.25;  ///< What is so near the line between its neighbours is a wall.
  int min_points = 1;              ///< Fewest beams on a trunk.
  double max_mean_square_residual = 6.0;  ///< Of the ranges from the fitted circle, in sigma^2.
};

/// What both kinds of landmark need of a sweep in space. Noise figures: Velodyne, 16 to 64 beams.
struct SweepParameters {
  double min_range_m = 1.0;       ///< Nearer returns are of the vehicle itself.
  double max_range_m = 30.0;      ///< Landmarks farther than this are not reported.
  double range_sigma_m = 0.02;    ///< Of one beam.
  double beam_width_rad = 0.0;    ///< By how much a beam's footprint widens an object on each side.
  double min_height_m = 0.3;      ///< Above ground: what is lower is ground, grass, stones.
  double max_height_m = 4.0;      ///< Above ground: what is higher is canopy.
  double break_distance_m = 0.3;  ///< Neighbouring returns farther apart are two objects...
  double break_per_range = 0.01;  ///< ... plus this much per metre of range.
  double clearance_m = 0.4;       ///< What stands beside an object's edge is so much farther away.
  double standing_height_m = 2.2;  ///< What ends below this is a person, a bush, a car, a stump.
  double breast_height_m = 1.3;    ///< Above ground: where a landmark's position is given.
  double level_sigma_rad = 0.01;   ///< Of roll and of pitch where the sweep does not say them.
};

/// Trunks from lasers that scan in space.
struct SweepTrunkParameters {
  double min_radius_m = 0.03;          ///< Posts of street signs are pipes of 60 mm diameter.
  double max_radius_m = 0.8;           ///< Of a trunk.
  double prior_radius_m = 0.15;        ///< A trunk's radius before it is measured.
  double prior_radius_sigma_m = 0.15;  ///< Of the prior.
  double prior_lean_sigma_rad = 0.06;  ///< Of a trunk's axis from the vertical.
  double prior_taper = -0.01;          ///< Change of radius per metre of height.
  double prior_taper_sigma = 0.01;     ///< Of the prior.
  double roundness_sigma_m = 0.005;    ///< Deviation of the bark from a circle.
  /// RMS deviation of a stem's outline from a circle in its low waves (oval, three-cornered), part
  /// of its radius; more points do not average it out. Greatest and least diameter of trees differ
  /// by 3 to 5 %.
  double out_of_round = 0.015;
  double max_lean_rad = 0.35;             ///< More than that is a branch.
  double max_sigma_m = 0.08;              ///< Trunks with a larger sigma of the centre: left out.
  double max_mean_square_residual = 3.0;  ///< Of ranges and edges from the axis, in sigma^2.
  double gather_radius_m = 0.3;           ///< How far apart the slices of one trunk may seem.
  double leaf_radius_m = 0.6;             ///< Of the returns so near a trunk...
  double min_share = 0.4;                 ///< ... at least this part must be on it.
  int min_points = 5;                     ///< Fewest returns on a trunk.
  int min_rings = 2;                      ///< Fewest rings that measure it.
};

/// Corners of houses from lasers that scan in space.
struct CornerParameters {
  double line_tolerance_m = 0.06;    ///< What is so near a line is on it.
  double min_length_m = 0.6;         ///< Of a wall, as far as it is seen.
  double min_extent_m = 0.8;         ///< In height, of the returns on a wall.
  double max_gap_m = 0.3;            ///< From the end of a wall's returns to the corner...
  double max_gap_per_range = 0.02;   ///< ... plus this much per metre of range.
  double max_skew_rad = 0.2;         ///< Of the angle between the walls from a right one.
  double flatness_sigma_m = 0.0005;  ///< Of a wall, besides the unevenness that its points show.
  int min_rings = 3;                 ///< Fewest rings that measure a wall.
};

/// Corners of houses from lasers that sweep one plane: both faces longer than a car is wide.
inline CornerParameters planar_corner() {
  CornerParameters corner;
  corner.line_tolerance_m = 0.1;
  corner.min_length_m = 2.2;
  corner.flatness_sigma_m = 0.01;
  corner.min_rings = 1;
  corner.min_extent_m = 0.0;
  return corner;
}

/// Clouds for loop detectors that compare clouds: PLACE_SCAN.
struct PlaceScanParameters {
  double period_s = 0.0;      ///< From one to the next; 0 = none.
  double cube_m = 0.6;        ///< One point is kept of each cube with edges of this.
  double max_range_m = 40.0;  ///< Points farther away in the plan are left out.
  int most_points = 1000;     ///< 6 bytes each; a place of the loop closer keeps them.
};

/// All parameters of the stage.
struct LandmarkExtractorParameters {
  PlanarTrunkParameters planar;
  SweepParameters sweep;
  SweepTrunkParameters trunk;
  CornerParameters corner;
  CornerParameters planar_corner = landmark_extractor::planar_corner();
  PlaceScanParameters place_scan;
};

}  // namespace understory::landmark_extractor
