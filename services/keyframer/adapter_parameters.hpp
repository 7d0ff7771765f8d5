// The keyframer's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer {

/// Adds each parameter to the table, bound to its member of `parameters`; the defaults are those of
/// the struct. Keys of older versions are refused with the new key in the message.
void describe(KeyframerParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::keyframer
