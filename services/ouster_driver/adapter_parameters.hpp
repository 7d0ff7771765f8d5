// The Ouster driver's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/ouster_driver/parameters.hpp"

namespace understory::ouster_driver {

/// Adds every parameter to the table, with unit, range and meaning. `parameters` must outlive it.
void describe(OusterDriverParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::ouster_driver
