#include "common/geometry/se2.hpp"

#include <cmath>
#include <numbers>

namespace understory::geometry {
namespace {

constexpr double kSmallAngle = 1e-5;

/// sin(t)/t and (1-cos(t))/t, by series near zero.
struct VCoefficients {
  double a;
  double b;
};
VCoefficients v_coefficients(double theta) {
  if (std::abs(theta) < kSmallAngle) return {1.0 - theta * theta / 6.0, 0.5 * theta};
  const double half_sine = std::sin(0.5 * theta);  // 1 - cos cancels for small angles
  return {std::sin(theta) / theta, 2.0 * half_sine * half_sine / theta};
}

}  // namespace

double wrap_angle(double angle_rad) {
  if (angle_rad > -std::numbers::pi && angle_rad <= std::numbers::pi) return angle_rad;
  const double wrapped = std::remainder(angle_rad, 2.0 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? wrapped + 2.0 * std::numbers::pi : wrapped;
}

SE2 SE2::Exp(const Eigen::Vector3d& xi) {
  const auto [a, b] = v_coefficients(xi.z());
  return {a * xi.x() - b * xi.y(), b * xi.x() + a * xi.y(), xi.z()};
}

Eigen::Vector3d SE2::Log() const {
  const auto [a, b] = v_coefficients(theta_);
  const double scale = 1.0 / (a * a + b * b);
  return {scale * (a * x() + b * y()), scale * (-b * x() + a * y()), theta_};
}

Eigen::Matrix2d SE2::rotation() const {
  const double c = std::cos(theta_);
  const double s = std::sin(theta_);
  return (Eigen::Matrix2d() << c, -s, s, c).finished();
}

SE2 SE2::inverse() const { return {rotation().transpose() * -translation_, -theta_}; }

SE2 SE2::operator*(const SE2& other) const {
  return {translation_ + rotation() * other.translation_, theta_ + other.theta_};
}

Eigen::Vector2d SE2::operator*(const Eigen::Vector2d& point) const {
  return rotation() * point + translation_;
}

Eigen::Matrix3d SE2::Adjoint() const {
  Eigen::Matrix3d adjoint = Eigen::Matrix3d::Identity();
  adjoint.topLeftCorner<2, 2>() = rotation();
  adjoint(0, 2) = y();
  adjoint(1, 2) = -x();
  return adjoint;
}

Eigen::Matrix3d inverse_right_jacobian(const Eigen::Vector3d& xi) {
  // J_r^-1 = I + ad/2 + c(theta) ad^2 with ad = ad_xi; exact, since ad^3 = -theta^2 ad.
  const double theta = xi.z();
  Eigen::Matrix3d ad = Eigen::Matrix3d::Zero();
  ad(0, 1) = -theta;
  ad(1, 0) = theta;
  ad(0, 2) = xi.y();
  ad(1, 2) = -xi.x();
  const double half = 0.5 * theta;
  const double c = std::abs(theta) < 1e-3
                       ? 1.0 / 12.0 + theta * theta / 720.0
                       : (1.0 - half * std::cos(half) / std::sin(half)) / (theta * theta);
  return Eigen::Matrix3d::Identity() + 0.5 * ad + c * ad * ad;
}

SE2WithCovariance compound(const SE2WithCovariance& a_T_b, const SE2WithCovariance& b_T_c) {
  const Eigen::Matrix3d adjoint = b_T_c.mean.inverse().Adjoint();
  return {a_T_b.mean * b_T_c.mean,
          adjoint * a_T_b.covariance * adjoint.transpose() + b_T_c.covariance};
}

SE2WithCovariance inverse(const SE2WithCovariance& a_T_b) {
  const Eigen::Matrix3d adjoint = a_T_b.mean.Adjoint();
  return {a_T_b.mean.inverse(), adjoint * a_T_b.covariance * adjoint.transpose()};
}

}  // namespace understory::geometry
