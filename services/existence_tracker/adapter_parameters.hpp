// The existence tracker's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/existence_tracker/parameters.hpp"

namespace understory::existence_tracker {

/// Adds each parameter to the table, bound to its member of `parameters`; the defaults are those of
/// the struct.
void describe(TrackerParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::existence_tracker
