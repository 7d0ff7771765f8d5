// The associator's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/associator/parameters.hpp"

namespace understory::associator {

void describe(AssociatorParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::associator
