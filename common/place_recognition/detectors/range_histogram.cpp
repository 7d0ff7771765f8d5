#include "common/place_recognition/detectors/range_histogram.hpp"

#include <cmath>

namespace understory::place_recognition::detectors {

bool RangeHistogram::describe(const PlaceFrame& frame, std::span<float> row) const {
  const double per_m = static_cast<double>(parameters_.bins) / parameters_.max_range_m;
  std::vector<double> count(parameters_.bins, 0.0);
  double all = 0.0;
  for (const Eigen::Vector3f& point : points_of(frame)) {
    const double place = point.cast<double>().norm() * per_m;
    if (place >= static_cast<double>(parameters_.bins)) continue;
    count[static_cast<std::size_t>(place)] += 1.0;
    all += 1.0;
  }
  if (all == 0.0) return false;

  for (std::size_t i = 0; i < parameters_.bins; ++i) row[i] = static_cast<float>(count[i] / all);
  return true;
}

RowDistance RangeHistogram::compare(std::span<const float> query,
                                    std::span<const float> frame) const {
  double ahead = 0.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < query.size(); ++i) {
    ahead += static_cast<double>(query[i]) - static_cast<double>(frame[i]);
    sum += std::abs(ahead);
  }
  return {sum / static_cast<double>(parameters_.bins), 0};
}

std::vector<geometry::SE2WithCovariance> RangeHistogram::guesses(std::size_t /*shift*/) const {
  return {};
}

}  // namespace understory::place_recognition::detectors
