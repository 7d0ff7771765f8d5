// The mapper's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper {

/// What the adapter decides itself.
struct MapperOutputParameters {
  double map_period_s = 2.0;
  double moved_m = 0.001;
  double reset_distance_m = 0.5;
  double reset_angle_rad = 0.05;
};

void describe(MapperParameters& parameters, bus::ParameterTable& table);
void describe(MapperOutputParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::geoslam_mapper
