#include "services/ekf/chi_squared.hpp"

#include <cmath>

namespace understory::ekf {
namespace {

/// Quantile of the standard normal distribution, by bisection.
double normal_quantile(double probability) {
  double low = -40.0;
  double high = 40.0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double chi_squared_quantile(double probability, int degrees) {
  if (degrees == 2) return -2.0 * std::log1p(-probability);
  const double spread = 2.0 / (9.0 * degrees);
  const double root = 1.0 - spread + normal_quantile(probability) * std::sqrt(spread);
  return degrees * root * root * root;
}

}  // namespace understory::ekf
