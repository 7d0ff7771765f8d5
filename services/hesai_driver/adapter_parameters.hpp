// The Hesai driver's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/hesai_driver/parameters.hpp"

namespace understory::hesai_driver {

/// Adds every parameter to the table, with unit, range and meaning. `parameters` must outlive it.
void describe(HesaiDriverParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::hesai_driver
