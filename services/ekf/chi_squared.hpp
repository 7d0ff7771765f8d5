// Quantiles of the chi-squared distribution.
#pragma once

namespace understory::ekf {

/// x with P(chi^2 of `degrees` < x) = probability: exact for two degrees, else the approximation of
/// Wilson and Hilferty (1931), within 1 % for probabilities of 0.9 and more.
double chi_squared_quantile(double probability, int degrees);

}  // namespace understory::ekf
