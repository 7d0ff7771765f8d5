#include "common/model/program_version.hpp"

#ifndef UNDERSTORY_VERSION
#error "UNDERSTORY_VERSION comes from CMake"
#endif

namespace understory::model {

std::string program_version() { return UNDERSTORY_VERSION; }

}  // namespace understory::model
