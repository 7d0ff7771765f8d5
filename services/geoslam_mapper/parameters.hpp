#pragma once

#include <string>

namespace understory::geoslam_mapper {

/// The source's own method (GeoSLAM Table 5.3). Symbols of the thesis in brackets.
struct BaselineMapperParameters {
  double descriptor_step = 0.05;             ///< [s] of the perimeter.
  int max_side_difference = 3;               ///< [Delta_N]
  double min_triangle_match_ratio = 0.5;     ///< [eta]
  double initial_descriptor_distance = 2.0;  ///< [tau]
  double descriptor_distance_step = 0.5;     ///< [psi]
  double max_descriptor_distance = 10.0;     ///< [m]
  int min_associations = 16;                 ///< [gamma]
  int max_pose_attempts = 75;                ///< [alpha]
  int pose_sample_size = 2;                  ///< [xi]
  double association_distance_m = 0.2;       ///< [Lambda]
  double discovery_distance_m = 2.5;         ///< [rho]
  double sensor_range_m = 40.0;              ///< [r]
  int min_pose_associations = 6;             ///< [mu]
  double early_exit_ratio = 0.9;             ///< [beta]
  int discovery_observations = 4;            ///< [k]
  int discovery_window = 5;                  ///< [omega]
  double discovery_association_m = 0.5;      ///< [delta]
  double max_newest_pose_error = 10000.0;    ///< Rollback threshold, §5.3.
};

/// Ours.
struct SmoothingMapperParameters {
  /// ODOMETRY between keyframes as a factor.
  bool use_odometry = false;
  /// Random walk of the gyro's bias, which is a variable of the graph where odometry has an IMU
  /// [rad/s/sqrt(s)]. What is found out about it later then straightens the way before. 0: the
  /// filter's word of the moment is taken for it.
  double gyro_walk = 1e-5;
  /// Never change the map that was given.
  bool localisation_only = false;
  /// A measurement is linearised again beyond this [sigmas]. On long roads that never come back,
  /// and loops of them, 1e-6: at 1e-4 the end of a 3 km road jumped by 0.25 m from keyframe to
  /// keyframe, at 1e-2 by metres. In a forest, which is stiff, that costs six times the time and
  /// gains nothing.
  double relinearise_above = 1e-2;
  /// Half width of the association gate, in standard deviations, and what is added to it.
  double gate_sigmas = 4.0;
  double gate_floor_m = 0.03;
  /// Of a predicted pose that no odometry made.
  double predicted_sigma_m = 0.25;
  double predicted_sigma_rad = 0.015;
  /// Matches over what can be matched: below, a predicted pose is not believed.
  double min_matched_ratio = 0.4;
  /// Fewest matches of a pose that odometry does not support.
  int min_matched = 4;
  /// A keyframe with at most two landmarks that moves so much otherwise than the filter says is not
  /// believed: what is taken for a trunk there may be somebody who walks. 0: the filter is not
  /// asked.
  double filter_disagreement_m = 0.2;
  /// Landmarks seen within so many keyframes share their error with the pose.
  int recent_keyframes = 20;
  /// A landmark enters the map when it was detected so often, in this share of the scans that had
  /// it in view.
  int min_observations = 3;
  double min_observation_ratio = 0.5;
  /// A candidate seen too seldom is forgotten after so many keyframes.
  int candidate_keyframes = 12;
  /// Two landmarks this near to each other that were never seen from one place are one.
  double merge_distance_m = 1.0;
  /// chi^2 (2 degrees of freedom) of one association after the update: beyond, it is taken out.
  double outlier_chi2 = 24.0;
  /// chi^2 of all associations as a normal deviate: beyond, the update is rolled back.
  double max_innovation_sigmas = 6.0;
  /// A keyframe this near to an earlier one, and so similarly turned, is folded into it.
  double fold_distance_m = 0.05;
  double fold_angle_rad = 0.02;
  /// Of a sighting's variance: what stays the same over so much way (a trunk is no cylinder, and
  /// looks the same from the same place); 0 = all noise is new in every scan.
  double correlated_share = 0.0;
  double correlation_m = 20.0;
  /// The same while the vehicle stands, where beams meet the same bark again and again.
  double stationary_share = 0.0;
  /// Of distances, the same for all landmarks and for ever. Told in covariances, not estimated.
  double scale_sigma = 0.0;
  /// A map begins with a keyframe whose ends the odometry ties to so much heading (before that the
  /// gyro's bias is unknown); but after so long with any.
  double start_heading_sigma_rad = 2e-3;
  double start_wait_s = 2.0;
  /// Of the landmarks of a given map that states no covariance.
  double given_map_sigma_m = 0.05;
};

struct MapperParameters {
  std::string method = "smoothing";  ///< "smoothing" or "baseline".
  BaselineMapperParameters baseline;
  SmoothingMapperParameters smoothing;
};

}  // namespace understory::geoslam_mapper
