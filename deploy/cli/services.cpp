#include "deploy/cli/services.hpp"

#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "services/landmark_extractor/adapter.hpp"

namespace understory {

std::vector<Service> all_services() {
  return {landmark_extractor_service(), keyframer_service(), geoslam_mapper_service()};
}

}  // namespace understory
