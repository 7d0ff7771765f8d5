// Rigid motions of the plane.
//
// Conventions used everywhere in Understory:
//  * `a_T_b` takes coordinates in frame b to coordinates in frame a.
//  * A tangent vector is (x [m], y [m], theta [rad]); a covariance of a pose has this order.
//  * A pose is perturbed on the right (in its own frame): T * Exp(xi), so its error is
//    Log(estimate^-1 * truth).
#pragma once

#include <Eigen/Core>

namespace understory::geometry {

/// The angle in (-pi, pi] that is equal to `angle_rad` modulo 2 pi.
double wrap_angle(double angle_rad);

/// A pose in the plane, or the rigid motion between two frames. The heading is kept in (-pi, pi].
class SE2 {
 public:
  /// The identity.
  SE2() = default;
  /// The heading is wrapped into (-pi, pi].
  SE2(double x_m, double y_m, double theta_rad)
      : translation_(x_m, y_m), theta_(wrap_angle(theta_rad)) {}
  /// The heading is wrapped into (-pi, pi].
  SE2(const Eigen::Vector2d& translation_m, double theta_rad)
      : translation_(translation_m), theta_(wrap_angle(theta_rad)) {}

  /// Exponential map: the motion of a body with constant twist `xi` over unit time.
  static SE2 Exp(const Eigen::Vector3d& xi);
  /// Inverse of Exp; theta in (-pi, pi].
  Eigen::Vector3d Log() const;

  /// First coordinate of the translation [m].
  double x() const { return translation_.x(); }
  /// Second coordinate of the translation [m].
  double y() const { return translation_.y(); }
  /// Heading [rad], in (-pi, pi].
  double theta() const { return theta_; }
  /// Translation [m].
  const Eigen::Vector2d& translation() const { return translation_; }
  /// Rotation matrix of the heading; one sine and one cosine per call.
  Eigen::Matrix2d rotation() const;
  /// (x, y, theta), for printing and for the wire. Not a tangent vector.
  Eigen::Vector3d coordinates() const { return {x(), y(), theta_}; }

  /// b_T_a of a_T_b.
  SE2 inverse() const;
  /// Composition: a_T_c = a_T_b * b_T_c.
  SE2 operator*(const SE2& other) const;
  /// The point [m] of frame b in frame a.
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const;

  /// Ad with T Exp(xi) T^-1 = Exp(Ad xi); 3 x 3.
  Eigen::Matrix3d Adjoint() const;

 private:
  Eigen::Vector2d translation_ = Eigen::Vector2d::Zero();
  double theta_ = 0.0;
};

/// d Log(Exp(xi) Exp(delta)) / d delta at delta = 0 (the inverse right Jacobian); 3 x 3.
Eigen::Matrix3d inverse_right_jacobian(const Eigen::Vector3d& xi);

/// A pose or motion with its covariance (3 x 3, tangent order, right perturbation).
struct SE2WithCovariance {
  SE2 mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Units m and rad.
};

/// Compounding of independent motions, to first order (Smith, Self & Cheeseman 1990).
SE2WithCovariance compound(const SE2WithCovariance& a_T_b, const SE2WithCovariance& b_T_c);
/// Inverse of an uncertain motion, to first order.
SE2WithCovariance inverse(const SE2WithCovariance& a_T_b);

/// The point rotated by +90 degrees: the derivative of R(theta) p by theta at zero.
inline Eigen::Vector2d perpendicular(const Eigen::Vector2d& p) { return {-p.y(), p.x()}; }

}  // namespace understory::geometry
