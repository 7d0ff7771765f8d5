// The viewer's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/viewer/parameters.hpp"

namespace understory::viewer {

/// Adds each parameter to the table, bound to its member of `parameters`; the defaults are those of
/// the struct.
void describe(ViewerParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::viewer
