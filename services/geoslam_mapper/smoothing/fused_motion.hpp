// Fuses two measurements of one motion, and removes one of them again.
#pragma once

#include <Eigen/Core>

#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A measured motion.
struct MeasuredMotion {
  geometry::SE2 a_T_b;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< Of its right perturbation.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.a_T_b, s.information);
  }
};

/// Fuses both: minimises the sum of their squared errors. Directions that neither measures stay as
/// in `one`. The error is of second order in the distance of the two motions.
MeasuredMotion fused(const MeasuredMotion& one, const MeasuredMotion& other);
/// Removes a part from a fused motion. The inverse of fused(), except for rounding; information
/// that rounding would make negative becomes zero.
MeasuredMotion without(const MeasuredMotion& sum, const MeasuredMotion& part);

}  // namespace understory::geoslam_mapper::smoothing
