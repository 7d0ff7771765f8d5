// The Livox driver's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/livox_driver/parameters.hpp"

namespace understory::livox_driver {

/// Adds every parameter to the table, with unit, range and meaning. `parameters` must outlive it.
void describe(LivoxDriverParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::livox_driver
