// The landmark extractor's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/landmark_extractor/parameters.hpp"

namespace understory {

void describe(LandmarkExtractorParameters& parameters, ParameterTable& table);

}  // namespace understory
