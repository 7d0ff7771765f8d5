// The power of correlated errors, as equivalent white noise, from a variogram.
#pragma once

#include <cstddef>
#include <span>

namespace understory::model {

/// Half the mean square of the differences of a quantity over one lag, in units of a variance
/// common to all lags.
struct LagVariance {
  std::size_t lag = 0;   ///< Steps between the two values.
  double value = 1.0;    ///< The variogram at this lag.
  double degrees = 0.0;  ///< Degrees of freedom of its estimate.
};

/// The power of white noise with the same variance of the mean over many steps as the correlated
/// quantity: the variance plus twice the sum of its autocovariances over all lags (its spectral
/// density at frequency zero). The variance is the variogram's sill: its value at the longest lags
/// after isotonic regression (pool adjacent violators), because a variogram of fading memory does
/// not decrease. A lag below the sill by less than `sigmas` standard deviations of chance counts as
/// uncorrelated, so white noise gives 1. Between lags the variogram is linear.
///
/// `lags` in ascending order of lag; lags without degrees of freedom are skipped. Returns the power
/// divided by the variogram at `unit_lag`; 1 without data. A memory longer than the longest lag is
/// not observable: the result is then a lower bound. Cost: linear in the longest lag.
double white_noise_power(std::span<const LagVariance> lags, std::size_t unit_lag, double sigmas);

/// Whether the memory is longer than the lags: the variogram at the longest known lag exceeds that
/// at a quarter of it, or at the shortest one, by more than a share `most` and two standard
/// deviations. False where there is too little data.
bool outlasts(std::span<const LagVariance> lags, double most);

}  // namespace understory::model
