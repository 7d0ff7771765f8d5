// The version of Understory.
#pragma once

#include <string>

namespace understory::model {

/// The version in `--version`, HEALTH, CONFIG, map files and results, e.g. "0.2.0".
std::string program_version();

}  // namespace understory::model
