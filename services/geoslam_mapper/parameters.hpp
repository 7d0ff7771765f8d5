// Parameters of the methods of mapping. What each one does, with range and default, is documented
// once: in adapter_parameters.cpp, which `understory-geoslam-mapper --help` prints. Here stand the
// units that a name does not give.
#pragma once

#include <string>

namespace understory::geoslam_mapper {

/// The thesis's method (GeoSLAM Table 5.3). Symbols of the thesis in brackets.
struct BaselineMapperParameters {
  double descriptor_step = 0.05;             ///< [s] Share of the perimeter.
  int max_side_difference = 3;               ///< [Delta_N]
  double min_triangle_match_ratio = 0.5;     ///< [eta]
  double initial_descriptor_distance = 2.0;  ///< [tau] m
  double descriptor_distance_step = 0.5;     ///< [psi] m
  double max_descriptor_distance = 10.0;     ///< m
  int min_associations = 16;                 ///< [gamma]
  int max_pose_attempts = 75;                ///< [alpha]
  int pose_sample_size = 2;                  ///< [xi]
  double association_distance_m = 0.2;       ///< [Lambda]
  double discovery_distance_m = 2.5;         ///< [rho]
  double sensor_range_m = 40.0;              ///< [r]
  int min_pose_associations = 6;             ///< [mu]
  double early_exit_ratio = 0.9;             ///< [beta]
  int discovery_observations = 4;            ///< [k] Keyframes.
  int discovery_window = 5;                  ///< [omega] Keyframes.
  double discovery_association_m = 0.5;      ///< [delta]
  double max_newest_pose_error = 10000.0;    ///< Rollback threshold, GeoSLAM §5.3; chi^2.
};

/// The project's method: incremental smoothing with covariances.
struct SmoothingMapperParameters {
  // Evidence.
  bool use_odometry = false;
  double gyro_walk = 1e-5;         ///< rad/s/sqrt(s)
  double gyro_start_sigma = 5e-3;  ///< rad/s
  double predicted_sigma_m = 0.25;
  double predicted_sigma_rad = 0.015;
  double correlated_share = 0.0;  ///< Of a variance.
  double correlation_m = 20.0;
  double stationary_share = 0.0;       ///< Of a variance.
  double scale_sigma = 0.0;            ///< Ratio of distances.
  double odometry_scale_sigma = 0.01;  ///< Ratio of distances.
  double given_map_sigma_m = 0.05;

  // Association and its tests.
  double gate_sigmas = 4.0;
  double gate_floor_m = 0.03;
  double min_matched_ratio = 0.4;
  int min_matched = 4;
  double filter_disagreement_m = 0.2;
  int recent_keyframes = 20;
  double outlier_chi2 = 24.0;          ///< 2 degrees of freedom.
  double max_innovation_sigmas = 6.0;  ///< Of a standard normal deviate.

  // Growth of the map.
  bool localisation_only = false;
  double start_heading_sigma_rad = 2e-3;
  double start_wait_s = 2.0;
  int new_map_keyframes = 3;
  double lost_sigma_m = 5.0;
  double lost_sigma_rad = 0.2;
  int min_observations = 3;  ///< Scans.
  double min_observation_ratio = 0.5;
  int candidate_keyframes = 12;
  double merge_distance_m = 1.0;
  double fold_distance_m = 0.05;
  double fold_angle_rad = 0.02;
  double known_ground_m = 5.0;
  double condense_m = 20.0;
  double condense_of_range = 0.5;
  double condense_after_m = 50.0;
  double cut_sparse = 0.0;  ///< Landmarks.
  double cut_dense = 0.0;   ///< Landmarks.
  double cut_turn_rad = 0.0;
  double cut_longest_m = 500.0;
  int cut_size = 0;  ///< Nodes and landmarks.
  double hand_over_m = 0.0;
};

/// Which method, and the parameters of each.
struct MapperParameters {
  std::string method = "smoothing";  ///< "smoothing" or "baseline".
  BaselineMapperParameters baseline;
  SmoothingMapperParameters smoothing;
};

}  // namespace understory::geoslam_mapper
