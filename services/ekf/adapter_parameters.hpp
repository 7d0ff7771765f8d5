// The filter's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/ekf/parameters.hpp"

namespace understory::ekf {

void describe(EkfParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::ekf
