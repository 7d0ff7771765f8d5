// The landmark extractor's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/landmark_extractor/parameters.hpp"

namespace understory::landmark_extractor {

/// Adds every parameter to the table, with unit, range and meaning. `parameters` must outlive it.
void describe(LandmarkExtractorParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::landmark_extractor
