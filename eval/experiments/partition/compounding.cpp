#include "eval/experiments/partition/compounding.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace understory::eval::experiments::partition {
namespace {

using Index = Eigen::Index;

/// Spread of the unscented transform's sigma points; with kappa = 3 - n they match the fourth
/// moment of a normal variable, but their middle weight is negative where n > 3.
constexpr double kAlpha = 1e-1;
constexpr double kBeta = 2.0;

Eigen::Matrix2d rotation_by(double phi) {
  Eigen::Matrix2d r;
  r << std::cos(phi), -std::sin(phi), std::sin(phi), std::cos(phi);
  return r;
}

/// Number of coordinates of poses and points that are side by side.
struct Layout {
  std::size_t poses = 0;
  std::size_t points = 0;

  Index rows() const { return static_cast<Index>(3 * poses + 2 * points); }
  Index pose(std::size_t i) const { return static_cast<Index>(3 * i); }
  Index point(std::size_t i) const { return static_cast<Index>(3 * poses + 2 * i); }
};

/// Relations of the numbers (origin, poses, points).
Eigen::VectorXd evaluate_relations(const Eigen::VectorXd& numbers, const Layout& layout) {
  const Eigen::Vector3d origin = numbers.head<3>();
  const Eigen::Vector3d inverse = ominus(origin);
  Eigen::VectorXd result(layout.rows());
  for (std::size_t i = 0; i < layout.poses; ++i)
    result.segment<3>(layout.pose(i)) = oplus(inverse, numbers.segment<3>(3 + layout.pose(i)));
  for (std::size_t i = 0; i < layout.points; ++i) {
    const Eigen::Vector2d point = numbers.segment<2>(3 + layout.point(i));
    result.segment<2>(layout.point(i)) = rotation_by(inverse.z()) * point + inverse.head<2>();
  }
  return result;
}

/// [J_1 J_-, J_2] for each relation.
Eigen::MatrixXd relations_jacobian(const Eigen::VectorXd& numbers, const Layout& layout) {
  const Eigen::Vector3d origin = numbers.head<3>();
  const Eigen::Vector3d inverse = ominus(origin);
  const Eigen::Matrix3d by_origin = ominus_jacobian(origin);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(layout.rows(), layout.rows() + 3);
  for (std::size_t i = 0; i < layout.poses; ++i) {
    const Index row = layout.pose(i);
    const Eigen::Vector3d pose = numbers.segment<3>(3 + row);
    result.block<3, 3>(row, 0) = oplus_by_first(inverse, pose) * by_origin;
    result.block<3, 3>(row, 3 + row) = oplus_by_second(inverse);
  }
  for (std::size_t i = 0; i < layout.points; ++i) {
    const Index row = layout.point(i);
    const Eigen::Vector2d point = numbers.segment<2>(3 + row);
    const Eigen::Vector3d as_pose(point.x(), point.y(), 0.0);
    result.block<2, 3>(row, 0) = oplus_by_first(inverse, as_pose).topRows<2>() * by_origin;
    result.block<2, 2>(row, 3 + row) = rotation_by(inverse.z());
  }
  return result;
}

Relations unscented_relations(const Eigen::VectorXd& numbers, const Layout& layout,
                              const Eigen::MatrixXd& joint) {
  const auto n = static_cast<double>(numbers.size());
  const double scale = kAlpha * kAlpha * n;  // n + lambda
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(joint);
  const Eigen::VectorXd roots = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd lower = ldlt.matrixL();
  const Eigen::MatrixXd root = ldlt.transpositionsP().transpose() * (lower * roots.asDiagonal());

  const Eigen::VectorXd middle = evaluate_relations(numbers, layout);
  Eigen::VectorXd mean = (1.0 - n / scale) * middle;
  std::vector<Eigen::VectorXd> values;
  for (Index c = 0; c < root.cols(); ++c) {
    for (const double sign : {1.0, -1.0}) {
      values.push_back(evaluate_relations(numbers + sign * std::sqrt(scale) * root.col(c), layout));
      mean += values.back() / (2.0 * scale);
    }
  }

  const double middle_weight = 1.0 - n / scale + 1.0 - kAlpha * kAlpha + kBeta;
  const Eigen::VectorXd off = middle - mean;
  Eigen::MatrixXd covariance = middle_weight * off * off.transpose();
  for (const Eigen::VectorXd& value : values)
    covariance += (value - mean) * (value - mean).transpose() / (2.0 * scale);
  return {middle, covariance};
}

}  // namespace

Eigen::Vector3d oplus(const Eigen::Vector3d& ij, const Eigen::Vector3d& jk) {
  const double c = std::cos(ij.z());
  const double s = std::sin(ij.z());
  return {jk.x() * c - jk.y() * s + ij.x(), jk.x() * s + jk.y() * c + ij.y(), ij.z() + jk.z()};
}

Eigen::Vector3d ominus(const Eigen::Vector3d& ij) {
  const double c = std::cos(ij.z());
  const double s = std::sin(ij.z());
  return {-ij.x() * c - ij.y() * s, ij.x() * s - ij.y() * c, -ij.z()};
}

Eigen::Matrix3d oplus_by_first(const Eigen::Vector3d& ij, const Eigen::Vector3d& jk) {
  const Eigen::Vector3d ik = oplus(ij, jk);
  Eigen::Matrix3d j = Eigen::Matrix3d::Identity();
  j(0, 2) = -(ik.y() - ij.y());
  j(1, 2) = ik.x() - ij.x();
  return j;
}

Eigen::Matrix3d oplus_by_second(const Eigen::Vector3d& ij) {
  Eigen::Matrix3d j = Eigen::Matrix3d::Identity();
  j.topLeftCorner<2, 2>() = rotation_by(ij.z());
  return j;
}

Eigen::Matrix3d ominus_jacobian(const Eigen::Vector3d& ij) {
  const Eigen::Vector3d ji = ominus(ij);
  const double c = std::cos(ij.z());
  const double s = std::sin(ij.z());
  Eigen::Matrix3d j;
  j << -c, -s, ji.y(), s, -c, -ji.x(), 0.0, 0.0, -1.0;
  return j;
}

Relations relations(const Eigen::Vector3d& origin, const std::vector<Eigen::Vector3d>& poses,
                    const std::vector<Eigen::Vector2d>& points, const Eigen::MatrixXd& joint,
                    Propagation propagation) {
  const Layout layout{poses.size(), points.size()};
  Eigen::VectorXd numbers(layout.rows() + 3);
  numbers.head<3>() = origin;
  for (std::size_t i = 0; i < poses.size(); ++i) numbers.segment<3>(3 + layout.pose(i)) = poses[i];
  for (std::size_t i = 0; i < points.size(); ++i)
    numbers.segment<2>(3 + layout.point(i)) = points[i];

  if (propagation == Propagation::kUnscented) return unscented_relations(numbers, layout, joint);
  const Eigen::MatrixXd j = relations_jacobian(numbers, layout);
  return {evaluate_relations(numbers, layout), j * joint * j.transpose()};
}

}  // namespace understory::eval::experiments::partition
