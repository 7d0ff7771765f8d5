// The mapper's parameters as a list: keys, units, ranges, meanings.
#pragma once

#include <string>

#include "common/bus/parameter_table.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper {

/// The given map and the size limits of messages. Documentation: see SmoothingMapperParameters.
struct MapperInputParameters {
  std::string map_file;  ///< Empty: none.
  int map_id = 0;        ///< 0: the only one in the file with landmarks.
  int max_detections = 2000;
  int max_keyframe_landmarks = 1000;
  int max_given_landmarks = 200000;
};

/// Decisions of the adapter about its outputs. Documentation: see SmoothingMapperParameters.
struct MapperOutputParameters {
  double map_period_s = 2.0;
  double map_share = 0.1;  ///< Share of all bytes that the mapper sends.
  double moved_m = 0.001;
  double reset_distance_m = 0.5;
  double reset_angle_rad = 0.05;
  double oldest_pose_s = 0.05;
};

/// Adds the parameters of the method to the table, with their older names.
void describe(SmoothingMapperParameters& parameters, bus::ParameterTable& table);
/// Adds the parameters of the inputs to the table.
void describe(MapperInputParameters& parameters, bus::ParameterTable& table);
/// Adds the parameters of the outputs to the table.
void describe(MapperOutputParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::geoslam_mapper
