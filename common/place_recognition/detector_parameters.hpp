// Parameters of the loop detectors; one struct each.
#pragma once

#include <cstddef>

#include "common/place_recognition/stem_recogniser.hpp"

namespace understory::place_recognition {

/// Histogram of ranges (Röhling et al. 2015; thesis 002 §2.4.1, eq. 2.22).
struct RangeHistogramParameters {
  std::size_t bins = 80;      ///< [b], >= 1.
  double max_range_m = 40.0;  ///< Points farther away are left out.
};

/// Histogram of distance and bearing of pairs of landmarks (Himstedt et al. 2014; thesis 002
/// §2.4.1). GLAROT (Rizzini 2015) compares the same histogram under all shifts of the bearing.
struct GlareParameters {
  std::size_t range_bins = 80;    ///< [n_rho], >= 1.
  double range_step_m = 0.5;      ///< Pairs farther apart than the last bin are left out.
  std::size_t bearing_bins = 16;  ///< [n_theta], >= 1, of pi.
  /// Standard deviations of the Gaussian that a pair adds; it ends at three of them.
  double sigma_range_m = 0.35;
  double sigma_bearing_rad = 0.15;
};

/// Histogram of distance and direction of pairs of landmarks in space (Rizzini 2017; thesis 002
/// §2.4.1, eqs. 2.26-2.29).
struct Glarot3dParameters {
  std::size_t grid = 4;         ///< [l] cells along an edge of a face of the cube, >= 1.
  std::size_t range_bins = 40;  ///< >= 1.
  double range_step_m = 1.0;    ///< Pairs farther apart than the last bin are left out.
};

/// Scan Context (Kim & Kim 2018; thesis 002 §2.4.1, eqs. 2.30-2.32).
struct ScanContextParameters {
  std::size_t rings = 20;            ///< [N_r], >= 1.
  std::size_t sectors = 60;          ///< [N_s], >= 1.
  double max_range_m = 40.0;         ///< Points farther away are left out.
  double lift_m = 2.0;               ///< Added to heights, so that the ground is above zero.
  double root_shift_m = 2.0;         ///< Copies of the query are shifted sideways by this.
  std::size_t root_shifts = 1;       ///< Number of copies to each side; 0 = the query alone.
  std::size_t ring_candidates = 50;  ///< Nearest ring keys whose frames are compared in full.
};

/// Geometric hierarchy (thesis 000 §3.2): similar polygons vote for frames.
struct HierarchyDetectorParameters {
  double max_descriptor_distance = 2.0;  ///< [tau]
  std::size_t most_frames = 30;  ///< Frames with the most votes, whose landmarks are matched.
  double gate_m = 0.5;           ///< Largest distance of pairs that agree on a motion.
  double max_distance_m = 12.0;  ///< Frames taken farther away are not searched.
};

/// One-shot search among identical landmarks (common/constellation), all frames in one map.
struct ConstellationDetectorParameters {
  double sigma_m = 0.05;         ///< Standard deviation of a landmark's position, per axis.
  double max_range_m = 80.0;     ///< Landmarks farther away are left out.
  double max_distance_m = 12.0;  ///< Frames taken farther away are not searched.
  /// Number of frames before and after the found one that are compared with the query separately.
  std::size_t reach = 8;
};

/// Parameters of all detectors: make_detector() uses its part.
struct DetectorParameters {
  RangeHistogramParameters range_histogram;
  GlareParameters glare;
  Glarot3dParameters glarot_3d;
  ScanContextParameters scan_context;
  HierarchyDetectorParameters hierarchy;
  ConstellationDetectorParameters constellation;
  StemRecogniserParameters stems;
  /// Standard deviation per axis of a query's position around a similar frame [m], for detectors
  /// that find only a heading.
  double place_sigma_m = 2.5;
};

}  // namespace understory::place_recognition
