// Parameters of the thesis's mapper.
#pragma once

namespace understory::eval::baselines::mapper {

/// The values of GeoSLAM Table 5.3. Symbols of the thesis in brackets.
struct Parameters {
  double descriptor_step = 0.05;             ///< [s] Share of the perimeter.
  int max_side_difference = 3;               ///< [Delta_N]
  double min_triangle_match_ratio = 0.5;     ///< [eta]
  double initial_descriptor_distance = 2.0;  ///< [tau] m
  double descriptor_distance_step = 0.5;     ///< [psi] m
  double max_descriptor_distance = 10.0;     ///< m
  int min_associations = 16;                 ///< [gamma]
  int max_pose_attempts = 75;                ///< [alpha]
  int pose_sample_size = 2;                  ///< [xi]
  double association_distance_m = 0.2;       ///< [Lambda] Largest distance of an inlier.
  double discovery_distance_m = 2.5;         ///< [rho] Beyond it a detection may be new.
  double sensor_range_m = 40.0;              ///< [r]
  int min_pose_associations = 6;             ///< [mu]
  double early_exit_ratio = 0.9;             ///< [beta] Share of inliers that ends the sampling.
  int discovery_observations = 4;            ///< [k] Keyframes.
  int discovery_window = 5;                  ///< [omega] Keyframes.
  double discovery_association_m = 0.5;      ///< [delta] Per axis.
  double max_newest_pose_error = 10000.0;    ///< Rollback threshold, GeoSLAM §5.3; chi^2.
};

}  // namespace understory::eval::baselines::mapper
