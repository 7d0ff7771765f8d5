// The associator's parameters. Ranges and the texts of --help are in adapter_parameters.cpp.
#pragma once

#include <string>

#include "common/model/detection_noise.hpp"

namespace understory::associator {

/// Parameters of the stage and of its process.
struct AssociatorParameters {
  /// "nearest": gated nearest neighbour at the predicted pose. "registered": the pose is refined
  /// first. "consistent": the largest set of pairs that fits one rigid motion, then refined.
  /// "auto": registered; consistent if the result does not fit.
  std::string method = "auto";
  double gate_sigmas = 4.0;        ///< Half width of the gate of a pair.
  double motion_sigma_m = 0.3;     ///< Of the step between two scans without a measurement.
  double motion_sigma_rad = 0.04;  ///< Of the rotation between two scans without a measurement.
  double max_rotation_rad = 0.5;   ///< Largest unpredicted rotation between two scans.
  double min_matched_ratio = 0.5;  ///< Least share of the possible matches in a scan that fits.
  int min_matched = 3;             ///< Least number of matches in a scan that fits.
  int max_misfits = 2;             ///< Successive scans without a fit before all tracks begin anew.
  int confirm_matches = 4;         ///< [k] Matches that make a track consistent ...
  int confirm_window = 6;          ///< [n] ... within this number of scans.
  int max_missed = 20;             ///< Successive scans without a match before a track ends.
  double keep_range_factor = 1.2;  ///< Tracks end beyond this multiple of the range.
  /// A match is published if it is more likely than any other pairing by this factor.
  double min_likelihood_ratio = 1000.0;
  /// Speed of a pedestrian; 0: no track is checked for motion (motion_check.hpp).
  double walking_mps = 0.8;
  int max_detections = 2000;  ///< Of one LANDMARKS message.
  model::DetectionNoiseParameters noise;
};

}  // namespace understory::associator
