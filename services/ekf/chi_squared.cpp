#include "services/ekf/chi_squared.hpp"

#include <boost/math/distributions/chi_squared.hpp>

namespace understory::ekf {

double chi_squared_quantile(double probability, int degrees) {
  namespace policies = boost::math::policies;
  using Policy = policies::policy<policies::promote_double<false>>;
  return boost::math::quantile(boost::math::chi_squared_distribution<double, Policy>(degrees),
                               probability);
}

}  // namespace understory::ekf
