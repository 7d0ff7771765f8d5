// The source's global map (GeoSLAM §4.3, algorithms 3-5), as its published code does it.
#pragma once

#include <memory>

#include "services/geoslam_mapper/mapper_method.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper::baseline {

/// No odometry, no covariances, no removal or merging of landmarks: the source has none.
std::unique_ptr<MapperMethod> make_baseline_mapper(const BaselineMapperParameters& parameters);

}  // namespace understory::geoslam_mapper::baseline
