// Parameters of the verifiers; one struct each.
#pragma once

#include <cstddef>

#include "common/place_recognition/detector_parameters.hpp"
#include "common/place_recognition/stem_likelihood.hpp"
#include "common/place_recognition/stem_triangles.hpp"

namespace understory::place_recognition {

/// Correspondence graph and its largest clique (Rizzini 2015; thesis 002 §2.4.2, eq. 2.33).
struct CorrespondenceGraphParameters {
  double tolerance_m = 0.3;         ///< [tau] Tolerance between distances of two pairs.
  std::size_t most_landmarks = 40;  ///< Landmarks of each frame, the nearest to the sensor.
  double diameter_log_tolerance =
      0.7;  ///< Largest difference of the logarithms of a pair's diameters, if known.
  double max_distance_m = 15.0;  ///< Largest distance between the two sensors.
  /// Branches of the search; then the largest clique so far is used.
  std::size_t most_branches = 200000;
};

/// Hough data association (Rizzini 2015; thesis 002 §2.4.2, eq. 2.34).
struct HoughParameters {
  double cell_m = 0.5;
  double cell_rad = 0.035;          ///< About 2 degrees.
  double max_distance_m = 15.0;     ///< Limit of the translation, per axis.
  std::size_t most_landmarks = 60;  ///< Landmarks of each frame, the nearest to the sensor.
  std::size_t most_cells = 20;      ///< Cells with most votes, from which a pose is refined.
  double gate_m = 0.5;              ///< Largest distance of pairs at the refined pose.
};

/// Iterative closest points (thesis 002 §2.4.2, algorithm 6 and eqs. 2.35-2.36).
struct IcpParameters {
  double first_distance_m = 3.0;  ///< [d_max] Limit of the first round; halved until ...
  double last_distance_m = 0.5;   ///< ... this.
  std::size_t most_rounds = 40;
  std::size_t neighbours = 12;  ///< Neighbours of a point for its normal and its covariance.
  /// Points with fewer than five neighbours within this count as round.
  double neighbour_radius_m = 1.5;
  double plane_epsilon = 1e-3;  ///< For Generalised ICP: variance along the normal, relative to 1.
  double inlier_m = 0.3;        ///< Largest distance of partners at the final pose.
  std::size_t most_points = 1000;  ///< Points of each frame; of more every n-th is used.
};

/// Parameters of all verifiers: make_verifier() uses its part.
struct VerifierParameters {
  double sigma_m = 0.07;  ///< Standard deviation per axis of the difference of a landmark's
                          ///< positions between two visits.
  CorrespondenceGraphParameters graph;
  HoughParameters hough;
  IcpParameters icp;
  ScanContextParameters scan_context;
  StemNoise stems;
  StemTriangleParameters triangles;
  /// Largest distance between the two sensors; farther poses are refused.
  double max_distance_m = 15.0;
  double place_sigma_m = 2.5;  ///< As in DetectorParameters.
};

}  // namespace understory::place_recognition
