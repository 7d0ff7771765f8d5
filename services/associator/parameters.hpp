// The associator's parameters.
#pragma once

#include <string>

namespace understory::associator {

struct AssociatorParameters {
  /// How detections and tracks are paired: "nearest" (gated nearest neighbour at the predicted
  /// pose), "registered" (the pose is refined first, in rounds), or "consistent" (the largest set
  /// of pairs that one rigid motion explains, then refined). "auto": registered, and consistent
  /// where that fits badly.
  std::string method = "auto";
  double gate_sigmas = 4.0;
  /// Of the motion between two scans where only the last motion predicts it.
  double motion_sigma_m = 0.3;
  double motion_sigma_rad = 0.04;
  double max_rotation_rad = 0.5;   ///< Largest unpredicted turn between two scans that is searched.
  double min_matched_ratio = 0.5;  ///< Of what could match: below, a scan is lost.
  int min_matched = 3;             ///< Fewest matches of a scan that fits.
  /// Scans in a row that fit no track and are passed over; then all tracks begin anew.
  int max_misfits = 2;
  int confirm_matches = 4;         ///< [k] A track is consistent once matched so often ...
  int confirm_window = 6;          ///< [n] ... in so many scans.
  int max_missed = 20;             ///< Scans in a row that should have shown it: it is dropped.
  double keep_range_factor = 1.2;  ///< Tracks farther than this times the range are dropped.
  /// A detection that another track explains nearly as well is not published: its likelihood must
  /// be so many times the other's.
  double min_likelihood_ratio = 1000.0;
  /// What moves against the wheels is no landmark; where few that stand are in view, a track is
  /// published once somebody who walks like this would have been noticed. 0: nothing is checked.
  double walking_mps = 0.8;
};

}  // namespace understory::associator
