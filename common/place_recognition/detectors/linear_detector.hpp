// Detectors that describe each frame by a row of numbers and compare all rows with the query's.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "common/place_recognition/place_detector.hpp"

namespace understory::place_recognition::detectors {

/// Distance of a frame's row from the query's, and its shift or rotation.
struct RowDistance {
  double distance = 0.0;  ///< Dimensionless; 0 = equal.
  std::size_t shift = 0;  ///< The tried shift with the smallest distance.
};

/// Keeps the best places, sorted: higher score first, ties by frame.
inline void keep_best(std::vector<ScoredPlace>& places, std::size_t most) {
  const auto order = [](const ScoredPlace& a, const ScoredPlace& b) {
    return std::tuple(-a.score, a.frame) < std::tuple(-b.score, b.frame);
  };
  const std::size_t kept = std::min(most, places.size());
  std::partial_sort(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(kept),
                    places.end(), order);
  places.resize(kept);
}

/// Compares the query with every frame; the score is minus the distance. `Signature` is a value
/// with
///   std::size_t length() const; numbers of a row bool describe(const PlaceFrame&,
///   std::span<float>) false where the frame has too little content RowDistance
///   compare(std::span<const float> query, std::span<const float> frame) const
///   std::vector<geometry::SE2WithCovariance> guesses(std::size_t shift) const
/// A frame with too little content is counted, but never found. Cost of a query: frames *
/// compare().
template <class Signature>
class LinearDetector final : public PlaceDetector {
 public:
  /// Without frames.
  explicit LinearDetector(Signature signature) : signature_(std::move(signature)) {}

  void add(const PlaceFrame& frame) override {
    const std::size_t length = signature_.length();
    rows_.resize((ids_.size() + 1) * length, 0.0F);
    says_something_.push_back(
        signature_.describe(frame, std::span(rows_).subspan(ids_.size() * length)));
    ids_.push_back(frame.id);
  }

  std::vector<ScoredPlace> query(const PlaceFrame& frame, const PlaceQuery& limits) const override {
    const std::size_t length = signature_.length();
    std::vector<float> row(length, 0.0F);
    std::vector<ScoredPlace> places;
    if (!signature_.describe(frame, row)) return places;

    std::vector<std::size_t> shifts;
    const auto end = static_cast<std::size_t>(
        std::upper_bound(ids_.begin(), ids_.end(), limits.newest) - ids_.begin());
    places.reserve(end);
    for (std::size_t i = 0; i < end; ++i) {
      if (!says_something_[i]) continue;
      const RowDistance found =
          signature_.compare(row, std::span(rows_).subspan(i * length, length));
      places.push_back({ids_[i], -found.distance, {}});
      shifts.push_back(found.shift);
    }
    return best_with_guesses(std::move(places), shifts, limits.most);
  }

  std::size_t size() const override { return ids_.size(); }
  std::size_t descriptor_bytes() const override { return rows_.size() * sizeof(float); }

 private:
  /// Guesses are made only for the kept places.
  std::vector<ScoredPlace> best_with_guesses(std::vector<ScoredPlace> places,
                                             const std::vector<std::size_t>& shifts,
                                             std::size_t most) const {
    std::vector<FrameId> order(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) order[i] = places[i].frame;
    keep_best(places, most);
    for (ScoredPlace& place : places) {
      const auto at = std::lower_bound(order.begin(), order.end(), place.frame) - order.begin();
      place.guesses = signature_.guesses(shifts[static_cast<std::size_t>(at)]);
    }
    return places;
  }

  Signature signature_;
  std::vector<FrameId> ids_;
  std::vector<char> says_something_;
  std::vector<float> rows_;  ///< length() numbers for each frame.
};

/// A pose with known heading only. Arguments are standard deviations.
inline geometry::SE2WithCovariance heading_guess(const geometry::SE2& frame_T_query,
                                                 double place_sigma_m, double heading_sigma_rad) {
  const double place = place_sigma_m * place_sigma_m;
  const Eigen::Vector3d variance(place, place, heading_sigma_rad * heading_sigma_rad);
  return {frame_T_query, variance.asDiagonal()};
}

}  // namespace understory::place_recognition::detectors
