// The choice between the methods of mapping.
#pragma once

#include <memory>

#include "services/geoslam_mapper/mapper_method.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper {

/// The method that `parameters.method` names, with an empty map. Throws std::invalid_argument on an
/// unknown name.
std::unique_ptr<MapperMethod> make_mapper(const MapperParameters& parameters);

}  // namespace understory::geoslam_mapper
