// The keyframer's parameters. Ranges and the texts of --help are in adapter_parameters.cpp.
#pragma once

#include "common/model/detection_noise.hpp"

namespace understory::keyframer {

/// The joint estimate of member poses and local landmarks.
struct JointKeyframerParameters {
  int observations_per_keyframe = 8;  ///< Scans.
  double gate_sigmas = 4.0;           ///< Half width of the association gate.
  double motion_sigma_m = 0.3;        ///< Of the step between two scans without odometry, per axis.
  double motion_sigma_rad = 0.04;     ///< Of the rotation between two scans without odometry.
  double max_rotation_rad = 0.5;      ///< Largest unpredicted rotation between two scans.
  double min_matched_ratio = 0.5;     ///< Least share of the landmarks that a scan can match.
  int min_matched = 4;                ///< Least number of matches of a scan without odometry.
  int min_observations = 2;           ///< A landmark with fewer observations is excluded.
  model::DetectionNoiseParameters noise;
};

/// Parameters of the process.
struct KeyframerParameters {
  int max_detections = 2000;  ///< Of one LANDMARKS message.
  JointKeyframerParameters joint;
};

}  // namespace understory::keyframer
