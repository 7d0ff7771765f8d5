// The keyframer's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer {

void describe(KeyframerParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::keyframer
