// The filter's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/ekf/parameters.hpp"

namespace understory {

void describe(EkfParameters& parameters, ParameterTable& table);

}  // namespace understory
