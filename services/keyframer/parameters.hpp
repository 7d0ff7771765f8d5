// The keyframer's parameters. Ranges and the texts of --help are in adapter_parameters.cpp.
#pragma once

#include <string>

#include "common/model/detection_noise.hpp"

namespace understory::keyframer {

/// The thesis's method, with the values of GeoSLAM Table 5.2. Symbols of the thesis in brackets.
struct BaselineKeyframerParameters {
  double descriptor_step = 0.05;            ///< [s] Sampling step, as a share of the perimeter.
  double max_descriptor_distance = 9.0;     ///< [tau] Limit for two polygons to match, m.
  int max_side_difference = 3;              ///< [Delta_N] Limit on the difference of sides.
  double min_triangle_match_ratio = 0.5;    ///< [eta] Least share of matched triangles.
  int min_associations = 7;                 ///< [gamma] Least number of matched landmarks.
  double max_association_distance_m = 1.0;  ///< [lambda]
  double cluster_tolerance_m = 1.0;         ///< [sigma]
  int observations_per_keyframe = 8;        ///< [n] Scans.
  int stale_after_observations = 3;         ///< [f] Scans.
};

/// The joint estimate of member poses and local landmarks.
struct JointKeyframerParameters {
  int observations_per_keyframe = 8;  ///< Scans.
  double gate_sigmas = 4.0;           ///< Half width of the association gate.
  double motion_sigma_m = 0.3;        ///< Of the step between two scans without odometry, per axis.
  double motion_sigma_rad = 0.04;     ///< Of the rotation between two scans without odometry.
  double max_rotation_rad = 0.5;      ///< Largest unpredicted rotation between two scans.
  double min_matched_ratio = 0.5;     ///< Least share of the landmarks that a scan can match.
  int min_matched = 4;                ///< Least number of matches of a scan without odometry.
  int min_observations = 2;           ///< A landmark with fewer observations is left out.
  model::DetectionNoiseParameters noise;
};

/// Parameters of the process: the method and the parameters of each method.
struct KeyframerParameters {
  std::string method = "joint";  ///< "joint" or "baseline".
  int max_detections = 2000;     ///< Of one LANDMARKS message.
  BaselineKeyframerParameters baseline;
  JointKeyframerParameters joint;
};

}  // namespace understory::keyframer
