#pragma once

#include <string>

namespace understory::keyframer {

/// The source's own method (GeoSLAM Table 5.2). Symbols of the thesis in brackets.
struct BaselineKeyframerParameters {
  double descriptor_step = 0.05;            ///< [s] of the perimeter.
  double max_descriptor_distance = 9.0;     ///< [tau]
  int max_side_difference = 3;              ///< [Delta_N]
  double min_triangle_match_ratio = 0.5;    ///< [eta]
  int min_associations = 7;                 ///< [gamma]
  double max_association_distance_m = 1.0;  ///< [lambda]
  double cluster_tolerance_m = 1.0;         ///< [sigma]
  int observations_per_keyframe = 8;        ///< [n]
  int stale_after_observations = 3;         ///< [f]
};

/// Ours: joint estimate of member poses and local landmarks.
struct JointKeyframerParameters {
  int observations_per_keyframe = 8;
  double gate_sigmas = 4.0;        ///< Association gate.
  double motion_sigma_m = 0.3;     ///< Of the step between two scans, where no odometry tells it.
  double motion_sigma_rad = 0.04;  ///< Likewise.
  double max_rotation_rad = 0.5;   ///< Largest unpredicted turn between two scans that is searched.
  double min_matched_ratio =
      0.5;  ///< Of the detections (or of the landmarks, if fewer): below, a scan is lost.
  int min_matched = 4;       ///< Fewest matches without odometry.
  int min_observations = 2;  ///< A landmark seen less often does not pass.
};

struct KeyframerParameters {
  std::string method = "joint";  ///< "joint" (ours) or "baseline".
  BaselineKeyframerParameters baseline;
  JointKeyframerParameters joint;
};

}  // namespace understory::keyframer
