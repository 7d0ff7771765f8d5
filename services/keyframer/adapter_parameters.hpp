// The keyframer's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory {

void describe(KeyframerParameters& parameters, ParameterTable& table);

}  // namespace understory
