// A linear least-squares similarity, the published code's getTf. Its scale is never taken out.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "common/geometry/se2.hpp"

namespace understory::eval::baselines::hierarchy {

/// q = s R p + t, kept as the four parameters of the linear problem.
struct Similarity {
  double cosine = 1.0;  ///< s cos(theta)
  double sine = 0.0;    ///< s sin(theta)
  Eigen::Vector2d translation_m = Eigen::Vector2d::Zero();

  /// The point moved by the similarity, scale included [m].
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const;
  /// First `other`, then this.
  Similarity operator*(const Similarity& other) const;
  /// The heading, with the translation as it was solved beside the scale.
  geometry::SE2 pose() const;
};

/// Least squares for to[i] ~ similarity * from[i] over equally weighted pairs; none when all `from`
/// coincide. Precondition: from.size() == to.size().
std::optional<Similarity> fit_similarity(std::span<const Eigen::Vector2d> from,
                                         std::span<const Eigen::Vector2d> to);

}  // namespace understory::eval::baselines::hierarchy
