// The baseline's global map (GeoSLAM §4.3, algorithms 3-5), as the thesis's published code has it.
#pragma once

#include <memory>

#include "services/geoslam_mapper/mapper_method.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper::baseline {

/// The thesis's method with an empty map: no odometry, no covariances, no removal or merging of
/// landmarks.
std::unique_ptr<MapperMethod> make_baseline_mapper(const BaselineMapperParameters& parameters);

}  // namespace understory::geoslam_mapper::baseline
