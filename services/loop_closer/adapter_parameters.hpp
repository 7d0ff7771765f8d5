// The loop closer's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/loop_closer/parameters.hpp"

namespace understory::loop_closer {

/// Adds each parameter to the table, bound to its member of `parameters`; the defaults are those of
/// the struct.
void describe(LoopCloserParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::loop_closer
