// The Velodyne driver's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/velodyne_driver/parameters.hpp"

namespace understory::velodyne_driver {

void describe(VelodyneDriverParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::velodyne_driver
