// Parameters of the loop closer. Meaning, range and default of each are documented once: in
// adapter_parameters.cpp, which `understory-loop-closer --help` prints. The comments here give
// units that are not in the name.
#pragma once

#include <string>

namespace understory::loop_closer {

/// Making of places, and when one is searched for.
struct PlaceParameters {
  double every_m = 4.0;    ///< Path.
  double window_m = 12.0;  ///< Path.
  double merge_m = 0.35;
  int min_stems = 5;
  int most_stems = 80;
  double min_loop_m = 100.0;  ///< Path.
  double known_share = 0.3;   ///< Of a keyframe's associations.
  double error_m = 0.05;
  double error_rad = 0.003;
};

/// Acceptance limits for a found place.
struct AcceptanceParameters {
  double chance_decades = 6.0;           ///< -log10 of a number of poses.
  double chance_decades_expected = 3.0;  ///< Likewise.
  double margin_decades = 4.0;           ///< log10 of a likelihood ratio.
  int min_pairs = 5;
  double gate_sigmas = 4.0;
  double closed_m = 15.0;  ///< Path.
};

/// Differences between the detected stems of two visits.
struct StemParameters {
  double sigma_m = 0.07;
  double matched_share = 0.6;
  bool use_diameters = true;
  double diameter_sigma = 0.16;  ///< Of its logarithm.
  double triangles = 300.0;
};

/// Names of the detector and of the verifier (common/place_recognition).
struct SearchParameters {
  std::string detector = "stems";
  std::string verifier = "none";
  int candidates = 3;
  int verified_pairs = 6;
  double verified_score = 0.5;  ///< Of verifiers that compare clouds.
};

/// All parameters.
struct LoopCloserParameters {
  PlaceParameters places;
  SearchParameters search;
  AcceptanceParameters accept;
  StemParameters stems;
};

}  // namespace understory::loop_closer
