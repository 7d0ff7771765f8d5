// Quantiles of what experiments measure.
#pragma once

#include <vector>

namespace understory::eval::tools {

/// The q-quantile by nearest rank (q = 0: the smallest, 1: the largest); 0 where there are no
/// values. Linear in their number.
double quantile(std::vector<double> values, double q);

}  // namespace understory::eval::tools
