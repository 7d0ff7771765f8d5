// Quantiles of what experiments measure.
#pragma once

#include <vector>

namespace understory::eval::tools {

/// The value that the part `q` of all (0 the least, 1 the largest) does not exceed, by nearest
/// rank; 0 where there are none. Linear in their number.
double quantile(std::vector<double> values, double q);

}  // namespace understory::eval::tools
