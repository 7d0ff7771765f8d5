// The parameters of learned noise, for each service that subscribes LANDMARKS.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "common/model/detection_noise.hpp"

namespace understory::bus {

/// Adds them to the table, under `noise.`.
void describe(model::DetectionNoiseParameters& parameters, ParameterTable& table);

}  // namespace understory::bus
