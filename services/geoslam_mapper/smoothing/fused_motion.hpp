// Two measurements of one motion as one, and one of them taken out again.
#pragma once

#include <Eigen/Core>

#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A measured motion.
struct MeasuredMotion {
  geometry::SE2 a_T_b;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< Of its error on the right.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.a_T_b, s.information);
  }
};

/// Both as one: where the sum of their squared errors is least. What neither measures stays as
/// `one` has it. Exact for motions that are near each other: the error is of second order.
MeasuredMotion fused(const MeasuredMotion& one, const MeasuredMotion& other);
/// What of a fused motion is left without a part of it. Undoes fused() but for rounding; what
/// rounding would make negative is zero.
MeasuredMotion without(const MeasuredMotion& sum, const MeasuredMotion& part);

}  // namespace understory::geoslam_mapper::smoothing
