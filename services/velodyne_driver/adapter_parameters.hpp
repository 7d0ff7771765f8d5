// The Velodyne driver's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/velodyne_driver/parameters.hpp"

namespace understory::velodyne_driver {

/// Adds every parameter to the table, with unit, range and meaning. `parameters` must outlive it.
void describe(VelodyneDriverParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::velodyne_driver
