#pragma once

#include <string>

namespace understory {

/// The source's own method (GeoSLAM Table 5.3). Symbols of the thesis in brackets.
struct SourceMapperParameters {
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
struct OwnMapperParameters {
  bool use_odometry = false;  ///< ODOMETRY between keyframes as a factor.
};

struct MapperParameters {
  std::string method = "ours";  ///< "ours" or "source".
  SourceMapperParameters source;
  OwnMapperParameters ours;
};

}  // namespace understory
