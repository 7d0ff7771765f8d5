// Histogram of the ranges of a frame's points, compared by the Wasserstein distance.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/place_recognition/detectors/linear_detector.hpp"

namespace understory::place_recognition::detectors {

/// Röhling, Mack & Schulz 2015 (thesis 002 §2.4.1): the share of the points in each of b intervals
/// of range (eq. 2.22); two of them differ by W = 1/b sum_i |sum_{j<=i} (g_j - h_j)| (eq. 2.23,
/// whose index of g is a misprint). The histogram is invariant to the heading and gives no
/// information on it.
class RangeHistogram {
 public:
  /// Precondition: at least one bin, a range > 0.
  explicit RangeHistogram(const RangeHistogramParameters& parameters) : parameters_(parameters) {}

  /// Numbers of a row: the bins.
  std::size_t length() const { return parameters_.bins; }
  /// Share of the points within the greatest range (in space) in each bin. False without points.
  bool describe(const PlaceFrame& frame, std::span<float> row) const;
  /// Wasserstein distance W; O(b).
  RowDistance compare(std::span<const float> query, std::span<const float> frame) const;
  /// None: the histogram has no information on the pose.
  std::vector<geometry::SE2WithCovariance> guesses(std::size_t shift) const;

 private:
  RangeHistogramParameters parameters_;
};

}  // namespace understory::place_recognition::detectors
