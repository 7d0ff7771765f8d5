// Errors that all observations share.
#pragma once

#include <Eigen/Core>

#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Common-mode errors: the graph cannot estimate them since no observation shows them. They are the
/// level error at the first keyframe, and the error of the scale of distances that remains after
/// RangeScale. They are part of the reported covariances of poses.
class CommonError {
 public:
  /// `scale_sigma`: standard deviation of the scale of distances (1e-3 = 1 mm per metre).
  explicit CommonError(double scale_sigma) : scale_sigma_(scale_sigma) {}

  /// Sets the present standard deviation of the scale.
  void set_scale_sigma(double sigma) { scale_sigma_ = sigma; }
  /// Sets the covariance [rad^2] of the level error (roll, pitch) at the keyframe that starts the
  /// map: it displaces landmarks at breast height.
  void set_start_level(const Eigen::Matrix2d& covariance);
  /// Displacement of landmarks [m], frame `map`, by an error (roll, pitch) of the first keyframe's
  /// level [rad].
  static Eigen::Vector2d displacement_m(const Eigen::Vector2d& level_rad);
  /// Contribution to the covariance of a pose (right perturbation).
  Eigen::Matrix3d covariance_at(const geometry::SE2& map_T_vehicle) const;
  /// Contribution to the covariance [m^2] of a point, frame `map`.
  Eigen::Matrix2d covariance_of(const Eigen::Vector2d& position_m) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.start_covariance_m2_, self.scale_sigma_);
  }

 private:
  double scale_sigma_;
  /// Covariance of the first scan's position relative to its observations: frame `map` [m^2].
  Eigen::Matrix2d start_covariance_m2_ = Eigen::Matrix2d::Zero();
};

}  // namespace understory::geoslam_mapper::smoothing
