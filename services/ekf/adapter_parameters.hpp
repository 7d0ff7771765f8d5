// The filter's parameters as a table: keys, units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/ekf/parameters.hpp"

namespace understory::ekf {

/// Adds all parameters to `table`, and the keys of older versions, which are refused. `parameters`
/// must outlive the table.
void describe(EkfParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::ekf
