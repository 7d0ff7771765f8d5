#include "eval/tools/quantile.hpp"

#include <algorithm>
#include <cmath>

namespace understory::eval::tools {

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(
                                       std::lround(q * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace understory::eval::tools
