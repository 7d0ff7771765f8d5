// Parameters of the mapper. Meaning, range and default of each are documented once: in
// adapter_parameters.cpp, which `understory-geoslam-mapper --help` prints. The comments here give
// units that are not in the name.
#pragma once

namespace understory::geoslam_mapper {

/// Parameters of incremental smoothing with covariances.
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
  double condense_after_m = 10.0;
  double cut_sparse = 0.0;  ///< Landmarks.
  double cut_dense = 0.0;   ///< Landmarks.
  double cut_turn_rad = 0.0;
  double cut_longest_m = 500.0;
  int cut_size = 0;  ///< Nodes and landmarks.
  double hand_over_m = 0.0;
};

}  // namespace understory::geoslam_mapper
