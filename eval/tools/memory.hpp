// Memory of this process.
#pragma once

#include <cstddef>

namespace understory::eval::tools {

/// Memory of this process that is in use now [MB].
double resident_mb();
/// Bytes that this process has taken from the heap and not given back. A difference of two is what
/// the code between them keeps, where one thread runs. Cost: a look at the heap's free lists.
std::ptrdiff_t heap_in_use();

}  // namespace understory::eval::tools
