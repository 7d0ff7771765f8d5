#include "deploy/cli/services.hpp"

#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"

namespace understory {

std::vector<Service> all_services() { return {keyframer_service(), geoslam_mapper_service()}; }

}  // namespace understory
