#include "services/geoslam_mapper/geoslam_mapper.hpp"

#include <stdexcept>

#include "services/geoslam_mapper/baseline/mapper.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::geoslam_mapper {

std::unique_ptr<MapperMethod> make_mapper(const MapperParameters& parameters) {
  if (parameters.method == "smoothing")
    return smoothing::make_smoothing_mapper(parameters.smoothing);
  if (parameters.method == "baseline") return baseline::make_baseline_mapper(parameters.baseline);
  throw std::invalid_argument("geoslam_mapper: method '" + parameters.method +
                              "' is not one of: smoothing, baseline");
}

}  // namespace understory::geoslam_mapper
