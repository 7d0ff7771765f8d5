// Parameters of the thesis's keyframer.
#pragma once

namespace understory::eval::baselines::keyframer {

/// The values of GeoSLAM Table 5.2. Symbols of the thesis in brackets.
struct Parameters {
  double descriptor_step = 0.05;            ///< [s] Sampling step, as a share of the perimeter.
  double max_descriptor_distance = 9.0;     ///< [tau] Limit for two polygons to match, m.
  int max_side_difference = 3;              ///< [Delta_N] Limit on the difference of sides.
  double min_triangle_match_ratio = 0.5;    ///< [eta] Least share of matched triangles.
  int min_associations = 7;                 ///< [gamma] Least number of matched landmarks.
  double max_association_distance_m = 1.0;  ///< [lambda] After alignment, per axis.
  double cluster_tolerance_m = 1.0;         ///< [sigma] Within it detections are one landmark.
  int observations_per_keyframe = 8;        ///< [n] Scans.
  int stale_after_observations = 3;         ///< [f] Scans.
};

}  // namespace understory::eval::baselines::keyframer
