// GLARE and GLAROT: histograms of the relative positions of a frame's pairs of landmarks.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/place_recognition/detectors/linear_detector.hpp"

namespace understory::place_recognition::detectors {

/// Whether frames passed with different headings are similar.
enum class BearingInvariance {
  kNone,     ///< GLARE (Himstedt, Frost, Hellbach, Böhme & Maehle 2014).
  kShifted,  ///< GLAROT (Rizzini 2015): the smallest distance under all shifts of the bearing.
};

/// Geometrical landmark relations (thesis 002 §2.4.1). Every pair of landmarks, of distance rho and
/// positive bearing theta in [0, pi) (a line has no direction), adds a Gaussian over (theta, rho),
/// sampled at the centres of the bins and cut off at three standard deviations; bearings wrap at
/// pi. The sum is normalised to 1. Two histograms differ by the L1 norm, 0 to 2; GLAROT takes the
/// least one under the shifts of eqs. 2.24 and 2.25.
class GlareSignature {
 public:
  /// Precondition: at least one bin of each, steps and sigmas > 0. `place_sigma_m`: sigma of a
  /// query's position around a similar frame.
  GlareSignature(const GlareParameters& parameters, BearingInvariance invariance,
                 double place_sigma_m);

  /// Numbers of a row: bins of range for each bin of bearing.
  std::size_t length() const { return parameters_.range_bins * parameters_.bearing_bins; }
  /// O(pairs * bins of a Gaussian). False with fewer than two landmarks in reach of each other.
  bool describe(const PlaceFrame& frame, std::span<float> row) const;
  /// L1 norm; O(bins), for GLAROT O(bins * bins of bearing).
  RowDistance compare(std::span<const float> query, std::span<const float> frame) const;
  /// The heading of the shift; for GLAROT it is modulo pi, so there are two.
  std::vector<geometry::SE2WithCovariance> guesses(std::size_t shift) const;

 private:
  void add_pair(double range_m, double bearing_rad, std::vector<double>& histogram) const;

  GlareParameters parameters_;
  BearingInvariance invariance_;
  double place_sigma_m_;
  double bearing_step_rad_;
};

}  // namespace understory::place_recognition::detectors
