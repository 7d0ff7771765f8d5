// Which version of Understory this is.
#pragma once

#include <string>

namespace understory::model {

/// As `--version`, HEALTH, CONFIG, map files and results state it, e.g. "0.2.0".
std::string program_version();

}  // namespace understory::model
