// Parameters of the extractor. Purpose and sensitivity of each: README.md.
#pragma once

namespace understory::landmark_extractor {

/// Trunks from one-plane lasers. Noise values: SICK LMS 2xx at 0.5 degrees.
struct PlanarTrunkParameters {
  double min_range_m = 1.5;     ///< Nearer returns are from the vehicle itself.
  double max_range_m = 40.0;    ///< Trunks farther than this are not reported.
  double range_sigma_m = 0.03;  ///< Of one beam.
  double beam_width_rad =
      0.001;  ///< Half the footprint of a beam: it widens a trunk by this on each side.
  double roundness_sigma_m = 0.03;  ///< Deviation of the bark from a circle.
  /// Error of the centre as seen from one side: trunks lean and are not cylinders.
  double shape_sigma_m = 0.08;
  /// That error is correlated over about this number of scans, and is modelled as white noise of
  /// the same power: averages over that many detections or more have a consistent covariance.
  double shape_correlation_scans = 8.0;
  double min_radius_m = 0.02;          ///< Of a trunk.
  double max_radius_m = 0.8;           ///< Of a trunk.
  double prior_radius_m = 0.15;        ///< A trunk's radius before it is measured.
  double prior_radius_sigma_m = 0.15;  ///< Of the prior.
  double break_distance_m = 0.35;  ///< Neighbouring returns farther apart belong to two objects...
  double break_per_range = 0.01;   ///< ... plus this much per metre of range.
  double clearance_m = 1.0;        ///< Least additional distance of an object beside a trunk.
  double separation_m = 2.0;  ///< Least distance of a trunk to any other object; bushes have less.
  double line_tolerance_m =
      0.25;  ///< An object this close to the line between its neighbours is part of a wall.
  int min_points = 1;  ///< Fewest beams on a trunk.
  double max_mean_square_residual =
      6.0;  ///< Of the ranges relative to the fitted circle, in sigma^2.
};

/// Parameters common to both kinds of landmark in a 3-D sweep. Noise values: Velodyne, 16 to 64
/// beams.
struct SweepParameters {
  double min_range_m = 1.0;     ///< Nearer returns are from the vehicle itself.
  double max_range_m = 30.0;    ///< Landmarks farther than this are not reported.
  double range_sigma_m = 0.02;  ///< Of one beam.
  double beam_width_rad =
      0.0;  ///< Half the footprint of a beam: it widens an object by this on each side.
  double min_height_m = 0.3;      ///< Above ground: lower returns are ground, grass, stones.
  double max_height_m = 4.0;      ///< Above ground: higher returns are canopy.
  double break_distance_m = 0.3;  ///< Neighbouring returns farther apart belong to two objects...
  double break_per_range = 0.01;  ///< ... plus this much per metre of range.
  double clearance_m = 0.4;       ///< Least additional distance of returns beside an object's edge.
  double standing_height_m = 2.2;  ///< Objects that end lower are persons, bushes, cars, stumps.
  double breast_height_m = 1.3;    ///< Above ground: height of a landmark's position.
  double level_sigma_rad = 0.01;   ///< Of roll and of pitch, if the sweep does not state them.
};

/// Trunks from 3-D lasers.
struct SweepTrunkParameters {
  double min_radius_m = 0.03;          ///< Posts of street signs are pipes of 60 mm diameter.
  double max_radius_m = 0.8;           ///< Of a trunk.
  double prior_radius_m = 0.15;        ///< A trunk's radius before it is measured.
  double prior_radius_sigma_m = 0.15;  ///< Of the prior.
  double prior_lean_sigma_rad = 0.06;  ///< Of a trunk's axis from the vertical.
  double prior_taper = -0.01;          ///< Change of radius per metre of height.
  double prior_taper_sigma = 0.01;     ///< Of the prior.
  double roundness_sigma_m = 0.005;    ///< Deviation of the bark from a circle.
  /// RMS deviation of a stem's outline from a circle in its low waves (oval, three-cornered),
  /// relative to its radius; more points do not average it out. Largest and smallest diameter of
  /// trees differ by 3 to 5 %.
  double out_of_round = 0.015;
  double max_lean_rad = 0.35;  ///< A stem with a larger lean is a branch.
  double max_sigma_m = 0.08;   ///< Trunks with a larger sigma of the centre are rejected.
  double max_mean_square_residual =
      3.0;                       ///< Of ranges and edges relative to the fitted stem, in sigma^2.
  double gather_radius_m = 0.3;  ///< Largest distance in the plan between the slices of one trunk.
  double leaf_radius_m = 0.6;    ///< Of the returns within this distance of a trunk...
  double min_share = 0.4;        ///< ... at least this share must be on it.
  int min_points = 5;            ///< Fewest returns on a trunk.
  int min_rings = 2;             ///< Fewest rings on a trunk.
};

/// Corners of houses from 3-D lasers.
struct CornerParameters {
  double line_tolerance_m = 0.06;    ///< Largest distance of points on a line.
  double min_length_m = 0.6;         ///< Of the visible part of a wall.
  double min_extent_m = 0.8;         ///< In height, of the returns on a wall.
  double max_gap_m = 0.3;            ///< From the end of a wall's returns to the corner...
  double max_gap_per_range = 0.02;   ///< ... plus this much per metre of range.
  double max_skew_rad = 0.2;         ///< Of the angle between the walls from a right one.
  double flatness_sigma_m = 0.0005;  ///< Of a wall, in addition to the unevenness of its points.
  int min_rings = 3;                 ///< Fewest rings on a wall.
};

/// Corners of houses from one-plane lasers: both faces longer than the width of a car.
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
  double period_s = 0.0;      ///< Time between clouds; 0 = none.
  double cube_m = 0.6;        ///< One point is kept per cube of this edge length.
  double max_range_m = 40.0;  ///< Points farther away in the plan are dropped.
  int most_points = 1000;     ///< 6 bytes each, stored in a place of the loop closer.
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
