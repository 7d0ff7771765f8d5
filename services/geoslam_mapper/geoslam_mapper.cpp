#include "services/geoslam_mapper/geoslam_mapper.hpp"

#include <stdexcept>

#include "services/geoslam_mapper/smoothing_mapper.hpp"
#include "services/geoslam_mapper/source_mapper.hpp"

namespace understory {

std::unique_ptr<MapperMethod> make_mapper(const MapperParameters& parameters) {
  if (parameters.method == "ours") return make_smoothing_mapper(parameters.ours);
  if (parameters.method == "source") return make_source_mapper(parameters.source);
  throw std::invalid_argument("geoslam_mapper: method '" + parameters.method +
                              "' is not one of ours, source");
}

}  // namespace understory
