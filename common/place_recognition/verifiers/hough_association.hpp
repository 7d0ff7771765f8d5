// Associates landmarks by the motion with the most votes of pairs.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/place_recognition/landmark_pairs.hpp"
#include "common/place_recognition/place_verifier.hpp"

namespace understory::place_recognition::verifiers {

/// A cell of the accumulator and its votes.
struct HoughCell {
  geometry::SE2 frame_T_query;  ///< Centre of the cell.
  std::size_t votes = 0;
};

/// Every pair of a query's and a frame's landmark votes, for each quantised heading theta, for the
/// translation t = p_frame - R(theta) p_query (thesis 002 eq. 2.34) within the limits. Returns at
/// most `most_cells` cells with the most votes (at least two), ties in order of heading, x, y.
/// Memory and time O(cells + headings * pairs).
std::vector<HoughCell> hough_cells(const LandmarkSets& landmarks,
                                   const HoughParameters& parameters);

/// Hough data association (Rizzini 2015; thesis 002 §2.4.2): from the best cells, pairs and pose
/// are refined alternately; the pose with the most one-to-one pairs is used. The score is their
/// number. Needs no guess.
class HoughVerifier final : public PlaceVerifier {
 public:
  /// Uses `hough`, `sigma_m` and `max_distance_m`.
  explicit HoughVerifier(const VerifierParameters& parameters) : parameters_(parameters) {}

  std::optional<VerifiedPlace> verify(
      const PlaceFrame& query, const PlaceFrame& frame,
      std::span<const geometry::SE2WithCovariance> guesses) const override;

 private:
  VerifierParameters parameters_;
};

}  // namespace understory::place_recognition::verifiers
