// What the verifiers can be told; one struct each.
#pragma once

#include <cstddef>

#include "common/place_recognition/detector_parameters.hpp"
#include "common/place_recognition/stem_likelihood.hpp"
#include "common/place_recognition/stem_triangles.hpp"

namespace understory::place_recognition {

/// Correspondence graph and its largest clique (Rizzini 2015; thesis 002 §2.4.2, eq. 2.33).
struct CorrespondenceGraphParameters {
  double tolerance_m = 0.3;         ///< [tau] between distances of two pairs.
  std::size_t most_landmarks = 40;  ///< Of each frame, the nearest to the sensor.
  double diameter_log_tolerance =
      0.7;                       ///< Pairs whose diameters, if known, differ by more are none.
  double max_distance_m = 15.0;  ///< Between the two sensors.
  /// Branches of the search; after these the largest clique so far is taken.
  std::size_t most_branches = 200000;
};

/// Hough data association (Rizzini 2015; thesis 002 §2.4.2, eq. 2.34).
struct HoughParameters {
  double cell_m = 0.5;
  double cell_rad = 0.035;          ///< About 2 degrees.
  double max_distance_m = 15.0;     ///< Bound of the translation, per axis.
  std::size_t most_landmarks = 60;  ///< Of each frame, the nearest to the sensor.
  std::size_t most_cells = 20;      ///< Those with most votes, from which a pose is refined.
  double gate_m = 0.5;              ///< Pairs of the refined pose are nearer.
};

/// Iterative closest points (thesis 002 §2.4.2, algorithm 6 and eqs. 2.35-2.36).
struct IcpParameters {
  double first_distance_m = 3.0;  ///< [d_max] of the first round; halved until ...
  double last_distance_m = 0.5;   ///< ... this.
  std::size_t most_rounds = 40;
  std::size_t neighbours = 12;      ///< Of a point, for its normal and its covariance.
  double neighbour_radius_m = 1.5;  ///< Points with fewer than five of them nearer count as round.
  double plane_epsilon = 1e-3;      ///< Of Generalised ICP: variance along the normal, over 1.
  double inlier_m = 0.3;            ///< Partners of the final pose are nearer.
  std::size_t most_points = 1000;   ///< Of each frame; of more every n-th is taken.
};

/// Of all verifiers: make_verifier() takes the part that it needs.
struct VerifierParameters {
  double sigma_m = 0.07;  ///< Of the difference of a landmark's positions of two visits, per axis.
  CorrespondenceGraphParameters graph;
  HoughParameters hough;
  IcpParameters icp;
  ScanContextParameters scan_context;
  StemNoise stems;
  StemTriangleParameters triangles;
  double max_distance_m = 15.0;  ///< Between the two sensors: a pose beyond is none.
  double place_sigma_m = 2.5;    ///< As of DetectorParameters.
};

}  // namespace understory::place_recognition
