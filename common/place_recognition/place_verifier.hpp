// The interface of all verifiers: do two frames show one place, and at which relative pose.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/place_frame.hpp"
#include "common/place_recognition/verifier_parameters.hpp"

namespace understory::place_recognition {

/// Pose of a query in a frame, if both show one place.
struct VerifiedPlace {
  geometry::SE2 frame_T_query;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Tangent order, right perturbation.
  /// A higher score is more certain; finite. Scores of two verifiers are not comparable.
  double score = 0.0;
  std::size_t inliers = 0;  ///< Landmarks or points of the query with a partner.
};

/// Compares two frames in detail (thesis 002 §2.4.2). Without state: safe to share.
class PlaceVerifier {
 public:
  PlaceVerifier() = default;
  virtual ~PlaceVerifier() = default;
  PlaceVerifier(const PlaceVerifier&) = delete;
  PlaceVerifier& operator=(const PlaceVerifier&) = delete;

  /// The likeliest relative pose; none where nothing fits or a frame has too little content. The
  /// caller decides by the score. A local search starts at `guesses` (frame_T_query), at the
  /// identity without any; a global search does not need them.
  virtual std::optional<VerifiedPlace> verify(
      const PlaceFrame& query, const PlaceFrame& frame,
      std::span<const geometry::SE2WithCovariance> guesses = {}) const = 0;
};

/// The verifiers' names, for a configuration, in the order of the decision's table.
std::vector<std::string> verifier_names();

/// Throws std::invalid_argument with `name` and the allowed names.
std::unique_ptr<PlaceVerifier> make_verifier(std::string_view name,
                                             const VerifierParameters& parameters = {});

/// Whether the verifier compares clouds of points (for a frame without one, its landmarks as
/// points). Throws likewise.
bool verifier_wants_cloud(std::string_view name);

}  // namespace understory::place_recognition
