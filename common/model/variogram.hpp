// How much correlated errors count: white noise of the same power, from a variogram.
#pragma once

#include <cstddef>
#include <span>

namespace understory::model {

/// Half the mean square of the differences of a quantity over one lag, in units of a variance that
/// all lags share.
struct LagVariance {
  std::size_t lag = 0;   ///< Steps between the two values.
  double value = 1.0;    ///< The variogram at this lag.
  double degrees = 0.0;  ///< Degrees of freedom that it rests on.
};

/// The power of white noise whose mean over many steps is as uncertain as that of the correlated
/// quantity: the variance plus twice the sum of its autocovariances over all lags (its spectral
/// density at frequency zero). The variance is the variogram's sill: its value at the longest lags
/// after isotonic regression (pool adjacent violators), since a variogram of fading memory does not
/// fall. A lag below the sill by less than `sigmas` standard deviations of chance counts as
/// uncorrelated, so white noise gives 1. Between lags the variogram is linear.
///
/// `lags` in ascending order of lag; those with no degrees of freedom are passed over. Returns the
/// power over the variogram at `unit_lag`; 1 where nothing is known. A memory longer than the
/// longest lag is not seen: the result is a lower bound then. Cost: linear in the longest lag.
double white_noise_power(std::span<const LagVariance> lags, std::size_t unit_lag, double sigmas);

/// Whether the memory is seen to be longer than the lags: the variogram at the longest lag that is
/// known is above that at a quarter of it, or at the shortest one, by more than a share `most` of
/// it and two standard deviations of chance. False where too little is known to say so.
bool outlasts(std::span<const LagVariance> lags, double most);

}  // namespace understory::model
