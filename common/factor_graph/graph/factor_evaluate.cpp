// Residuals of the factors and their derivatives.
#include <Eigen/Dense>
#include <cmath>

#include "common/factor_graph/graph/factor.hpp"

namespace understory::factor_graph::graph {
namespace {

using Eigen::Map;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
template <int rows, int columns>
using Jacobian = Map<Eigen::Matrix<double, rows, columns>>;

struct Plane {
  Vector2d translation;
  double theta;
  double c, s;

  /// R' v.
  Vector2d back(const Vector2d& v) const { return {c * v.x() + s * v.y(), -s * v.x() + c * v.y()}; }
  Matrix2d rotation() const { return (Matrix2d() << c, -s, s, c).finished(); }
};
Plane plane(const Value& v) { return {{v[0], v[1]}, v[2], v[3], v[4]}; }

/// Derivative of R' v by the rotation of R: d(R' v) = -S (R' v) d theta.
Vector2d turned_right(const Vector2d& v) { return {v.y(), -v.x()}; }

struct Space {
  Vector3d translation;
  Eigen::Quaterniond q;
};
Space space(const double* v) { return {{v[0], v[1], v[2]}, {v[6], v[3], v[4], v[5]}}; }

Vector3d twice_vector_part(Eigen::Quaterniond& q) {
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return 2.0 * q.vec();
}
/// d(2 vec(q Exp(d))) / d d.
Matrix3d vector_part_derivative(const Eigen::Quaterniond& q) {
  return q.w() * Matrix3d::Identity() + cross_matrix(q.vec());
}

void prior_pose2(const double* z, const Value& v, double* e, double* j) {
  const double c = std::cos(z[2]);
  const double s = std::sin(z[2]);
  const Vector2d d(v[0] - z[0], v[1] - z[1]);
  e[0] = c * d.x() + s * d.y();
  e[1] = -s * d.x() + c * d.y();
  e[2] = geometry::wrap_angle(v[2] - z[2]);
  if (j != nullptr) Jacobian<3, 3>(j) << c, s, 0, -s, c, 0, 0, 0, 1;
}

void relative_pose2(const double* z, const Value& va, const Value& vb, double* e, double* j) {
  const Plane a = plane(va);
  const Vector2d local = a.back(Vector2d(vb[0], vb[1]) - a.translation);
  const Plane measured{{z[0], z[1]}, z[2], z[3], z[4]};
  Map<Vector2d>(e, 2) = measured.back(local - measured.translation);
  e[2] = geometry::wrap_angle(vb[2] - va[2] - z[2]);
  if (j == nullptr) return;
  // (R_a R_z)'
  const double c = a.c * measured.c - a.s * measured.s;
  const double s = a.s * measured.c + a.c * measured.s;
  const Vector2d by_theta = measured.back(turned_right(local));
  Jacobian<3, 6>(j) << -c, -s, by_theta.x(), c, s, 0,  //
      s, -c, by_theta.y(), -s, c, 0,                   //
      0, 0, -1, 0, 0, 1;
}

/// The measured motion at the true rate: its rotation reduced by b * seconds, its path rotated back
/// by half of that.
void biased_relative_pose2(const double* z, const Value& va, const Value& vb, double bias,
                           double* e, double* j) {
  double by_poses[18];
  relative_pose2(z, va, vb, e, j == nullptr ? nullptr : by_poses);
  const Plane measured{{z[0], z[1]}, z[2], z[3], z[4]};
  const double seconds = z[kBiasedSeconds];
  const Vector2d shift =
      0.5 * seconds * measured.back(geometry::perpendicular(measured.translation));
  e[0] += shift.x() * bias;
  e[1] += shift.y() * bias;
  e[2] += seconds * bias;
  if (j == nullptr) return;
  Jacobian<3, 7> out(j);
  out.leftCols<6>() = Jacobian<3, 6>(by_poses);
  out.col(6) << shift, seconds;
}

void point2(const double* z, const Value& pose, const Value& point, double* e, double* j) {
  const Plane a = plane(pose);
  const Vector2d local = a.back(point2_of(point) - a.translation);
  e[0] = local.x() - z[0];
  e[1] = local.y() - z[1];
  if (j == nullptr) return;
  Jacobian<2, 5>(j) << -a.c, -a.s, local.y(), a.c, a.s, a.s, -a.c, -local.x(), -a.s, a.c;
}

void range_bearing2(const double* z, const Value& pose, const Value& point, double* e, double* j) {
  constexpr std::array<double, 2> kOrigin{0.0, 0.0};
  double local[2];
  double by_local[10];
  point2(kOrigin.data(), pose, point, local, j == nullptr ? nullptr : by_local);
  const double range = std::hypot(local[0], local[1]);
  e[0] = range - z[0];
  e[1] = geometry::wrap_angle(std::atan2(local[1], local[0]) - z[1]);
  if (j == nullptr) return;
  const double inverse = 1.0 / std::max(range, 1e-9);
  Matrix2d d;
  d << local[0] * inverse, local[1] * inverse, -local[1] * inverse * inverse,
      local[0] * inverse * inverse;
  Jacobian<2, 5>(j).noalias() = d * Jacobian<2, 5>(by_local);
}

void position2(const double* z, const Value& pose, double* e, double* j) {
  const Plane a = plane(pose);
  const Vector2d lever(a.c * z[2] - a.s * z[3], a.s * z[2] + a.c * z[3]);
  Map<Vector2d>(e, 2) = a.translation + lever - Vector2d(z[0], z[1]);
  if (j != nullptr) Jacobian<2, 3>(j) << 1, 0, -lever.y(), 0, 1, lever.x();
}

void prior_pose3(const double* z, const Value& v, double* e, double* j) {
  const Space measured = space(z);
  const Space pose = space(v.data());
  const Matrix3d back = measured.q.conjugate().toRotationMatrix();
  Eigen::Quaterniond error = measured.q.conjugate() * pose.q;
  Map<Vector3d>(e, 3) = back * (pose.translation - measured.translation);
  Map<Vector3d>(e + 3, 3) = twice_vector_part(error);
  if (j == nullptr) return;
  Jacobian<6, 6> out(j);
  out.setZero();
  out.topLeftCorner<3, 3>() = back;
  out.bottomRightCorner<3, 3>() = vector_part_derivative(error);
}

void relative_pose3(const double* z, const Value& va, const Value& vb, double* e, double* j) {
  const Space measured = space(z);
  const Space a = space(va.data());
  const Space b = space(vb.data());
  const Matrix3d a_back = a.q.conjugate().toRotationMatrix();
  const Matrix3d z_back = measured.q.conjugate().toRotationMatrix();
  const Eigen::Quaterniond a_q_b = a.q.conjugate() * b.q;
  Eigen::Quaterniond error = measured.q.conjugate() * a_q_b;
  const Vector3d local = a_back * (b.translation - a.translation);
  Map<Vector3d>(e, 3) = z_back * (local - measured.translation);
  Map<Vector3d>(e + 3, 3) = twice_vector_part(error);
  if (j == nullptr) return;

  Jacobian<6, 12> out(j);
  out.setZero();
  const Matrix3d both = z_back * a_back;
  const Matrix3d d = vector_part_derivative(error);
  out.block<3, 3>(0, 0) = -both;
  out.block<3, 3>(0, 3).noalias() = z_back * cross_matrix(local);
  out.block<3, 3>(3, 3).noalias() = -d * a_q_b.conjugate().toRotationMatrix();
  out.block<3, 3>(0, 6) = both;
  out.block<3, 3>(3, 9) = d;
}

void point3(const double* z, const Value& pose, const Value& point, double* e, double* j) {
  const Space a = space(pose.data());
  const Matrix3d back = a.q.conjugate().toRotationMatrix();
  const Vector3d local = back * (point3_of(point) - a.translation);
  Map<Vector3d>(e, 3) = local - Vector3d(z[0], z[1], z[2]);
  if (j == nullptr) return;
  Jacobian<3, 9> out(j);
  out << -back, cross_matrix(local), back;
}

void position3(const double* z, const Value& pose, double* e, double* j) {
  const Space a = space(pose.data());
  const Matrix3d rotation = a.q.toRotationMatrix();
  const Vector3d antenna(z[3], z[4], z[5]);
  Map<Vector3d>(e, 3) = a.translation + rotation * antenna - Vector3d(z[0], z[1], z[2]);
  if (j == nullptr) return;
  Jacobian<3, 6> out(j);
  out << Matrix3d::Identity(), -rotation * cross_matrix(antenna);
}

/// All other variables in the first variable's frame.
void condensed2(const double* z, std::span<const Value* const> values,
                std::span<const VariableType> types, double* e, double* j) {
  int rows = 0;
  int columns = 3;
  for (std::size_t i = 1; i < values.size(); ++i) rows += dimension(types[i]);
  columns += rows;
  Map<Eigen::MatrixXd> out(j, j == nullptr ? 0 : rows, j == nullptr ? 0 : columns);
  out.setZero();
  for (std::size_t i = 1, row = 0; i < values.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(row);
    const bool is_pose = types[i] == VariableType::kPose2;
    double blocks[18];
    if (is_pose) {
      const double wanted[5]{z[row], z[row + 1], z[row + 2], std::cos(z[row + 2]),
                             std::sin(z[row + 2])};
      relative_pose2(wanted, *values[0], *values[i], e + row, blocks);
    } else {
      point2(z + row, *values[0], *values[i], e + row, blocks);
    }
    const int size = dimension(types[i]);
    if (j != nullptr) {
      const Map<const Eigen::MatrixXd> own(blocks, size, 3 + size);
      out.block(at, 0, size, 3) = own.leftCols(3);
      out.block(at, 3 + at, size, size) = own.rightCols(size);
    }
    row += static_cast<std::size_t>(size);
  }
}

void prior_point(const double* z, const Value& v, int size, double* e, double* j) {
  for (int i = 0; i < size; ++i) e[i] = v[static_cast<std::size_t>(i)] - z[i];
  if (j != nullptr) Map<Eigen::MatrixXd>(j, size, size).setIdentity();
}

}  // namespace

void evaluate(FactorKind kind, const double* z, std::span<const Value* const> v,
              std::span<const VariableType> types, double* e, double* j) {
  switch (kind) {
    case FactorKind::kPriorPose2:
      return prior_pose2(z, *v[0], e, j);
    case FactorKind::kPriorPose3:
      return prior_pose3(z, *v[0], e, j);
    case FactorKind::kPriorPoint2:
      return prior_point(z, *v[0], 2, e, j);
    case FactorKind::kPriorPoint3:
      return prior_point(z, *v[0], 3, e, j);
    case FactorKind::kRelativePose2:
      return relative_pose2(z, *v[0], *v[1], e, j);
    case FactorKind::kBiasedRelativePose2:
      return biased_relative_pose2(z, *v[0], *v[1], (*v[2])[0], e, j);
    case FactorKind::kPriorScalar:
      return prior_point(z, *v[0], 1, e, j);
    case FactorKind::kStepScalar:
      e[0] = (*v[1])[0] - (*v[0])[0];
      if (j != nullptr) Jacobian<1, 2>(j) << -1.0, 1.0;
      return;
    case FactorKind::kRelativePose3:
      return relative_pose3(z, *v[0], *v[1], e, j);
    case FactorKind::kPoint2:
      return point2(z, *v[0], *v[1], e, j);
    case FactorKind::kPoint3:
      return point3(z, *v[0], *v[1], e, j);
    case FactorKind::kRangeBearing2:
      return range_bearing2(z, *v[0], *v[1], e, j);
    case FactorKind::kPosition2:
      return position2(z, *v[0], e, j);
    case FactorKind::kPosition3:
      return position3(z, *v[0], e, j);
    case FactorKind::kCondensed2:
      return condensed2(z, v, types, e, j);
    case FactorKind::kLinear:
    case FactorKind::kUser:
      return;
  }
}

}  // namespace understory::factor_graph::graph
