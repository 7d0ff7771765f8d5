// Memory of this process.
#pragma once

namespace understory::eval::tools {

/// Memory of this process that is in use now [MB].
double resident_mb();

}  // namespace understory::eval::tools
