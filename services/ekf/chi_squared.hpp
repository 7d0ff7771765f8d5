// Quantiles of the chi-squared distribution.
#pragma once

namespace understory::ekf {

/// x with P(chi^2 of `degrees` degrees of freedom < x) = `probability` (0 <= probability < 1), by
/// boost::math. Costs some microseconds: compute gates once.
double chi_squared_quantile(double probability, int degrees);

}  // namespace understory::ekf
