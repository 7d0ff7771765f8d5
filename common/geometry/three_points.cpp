// Lambda Twist: M. Persson, K. Nordberg, "Lambda Twist: An Accurate Fast Robust Perspective Three
// Point (P3P) Solver", ECCV 2018. The distances lambda of three points fulfil three quadratic
// equations lambda' M_ij lambda = a_ij; two linear combinations of them have a zero right side, and
// a member of the pencil of these two is a pair of planes.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/geometry/absolute_pose.hpp"

namespace understory::geometry {
namespace {

constexpr double kDegenerate = 1e-10;

/// The three equations: squared distances a_ij of the points, b_ij = -2 cos of the angle between
/// the bearings, for the pairs 12, 13, 23.
struct Distances {
  Eigen::Vector3d a;
  Eigen::Vector3d b;
};

/// A real root of x^3 + b x^2 + c x + d; of three real roots the outer one with the greater slope,
/// which is the best conditioned.
double cubic_root(double b, double c, double d) {
  const double shift = -b / 3.0;
  const double p = c - b * b / 3.0;
  const double q = b * (2.0 * b * b / 27.0 - c / 3.0) + d;
  const double discriminant = 0.25 * q * q + p * p * p / 27.0;

  double root = 0.0;
  if (discriminant >= 0.0) {
    // One real root; the form avoids a difference of nearly equal numbers.
    const double u = std::cbrt(-0.5 * q - std::copysign(std::sqrt(discriminant), q));
    root = u == 0.0 ? 0.0 : u - p / (3.0 * u);
  } else {
    const double r = std::sqrt(-p / 3.0);
    const double angle = std::acos(std::clamp(-0.5 * q / (r * r * r), -1.0, 1.0)) / 3.0;
    const double greatest = 2.0 * r * std::cos(angle);
    const double least = 2.0 * r * std::cos(angle + 2.0 * std::numbers::pi / 3.0);
    root = q < 0.0 ? greatest : least;
  }

  double x = root + shift;
  for (int i = 0; i < 3; ++i) {
    const double slope = (3.0 * x + 2.0 * b) * x + c;
    if (std::abs(slope) < kDegenerate) break;
    x -= (((x + b) * x + c) * x + d) / slope;
  }
  return x;
}

/// The matrix of one equation, for the pair of indices (i, j).
Eigen::Matrix3d equation(int i, int j, double b) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  m(i, i) = m(j, j) = 1.0;
  m(i, j) = m(j, i) = 0.5 * b;
  return m;
}

Eigen::Matrix3d adjugate(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d result;
  result.row(0) = m.col(1).cross(m.col(2));
  result.row(1) = m.col(2).cross(m.col(0));
  result.row(2) = m.col(0).cross(m.col(1));
  return result;
}

/// The member of the pencil that is a pair of planes; none where the equations are degenerate.
std::optional<Eigen::Matrix3d> plane_pair(const Distances& known) {
  const Eigen::Matrix3d m12 = equation(0, 1, known.b[0]);
  const Eigen::Matrix3d m13 = equation(0, 2, known.b[1]);
  const Eigen::Matrix3d m23 = equation(1, 2, known.b[2]);
  const Eigen::Matrix3d d1 = known.a[2] * m12 - known.a[0] * m23;
  const Eigen::Matrix3d d2 = known.a[2] * m13 - known.a[1] * m23;

  // det(d1 + g d2) = 0
  const double c3 = d2.determinant();
  const double c2 = (adjugate(d2) * d1).trace();
  const double c1 = (adjugate(d1) * d2).trace();
  const double c0 = d1.determinant();
  const double largest = std::max({std::abs(c3), std::abs(c2), std::abs(c1), std::abs(c0)});
  if (std::abs(c3) < kDegenerate * largest || largest == 0.0) return std::nullopt;
  return d1 + cubic_root(c2 / c3, c1 / c3, c0 / c3) * d2;
}

/// Newton's method on the three equations.
Eigen::Vector3d polished(Eigen::Vector3d l, const Distances& known) {
  constexpr int kSteps = 5;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector3d residual(
        l[0] * l[0] + l[1] * l[1] + known.b[0] * l[0] * l[1] - known.a[0],
        l[0] * l[0] + l[2] * l[2] + known.b[1] * l[0] * l[2] - known.a[1],
        l[1] * l[1] + l[2] * l[2] + known.b[2] * l[1] * l[2] - known.a[2]);
    Eigen::Matrix3d jacobian;
    jacobian << 2.0 * l[0] + known.b[0] * l[1], 2.0 * l[1] + known.b[0] * l[0], 0.0,  //
        2.0 * l[0] + known.b[1] * l[2], 0.0, 2.0 * l[2] + known.b[1] * l[0],          //
        0.0, 2.0 * l[1] + known.b[2] * l[2], 2.0 * l[2] + known.b[2] * l[1];
    const Eigen::Vector3d step = jacobian.partialPivLu().solve(residual);
    if (!step.allFinite()) break;
    l -= step;
  }
  return l;
}

/// Distances in the plane l0 = w0 l1 + w1 l2.
void solve_in_plane(double w0, double w1, const Distances& known,
                    std::vector<Eigen::Vector3d>& solutions) {
  const double a12 = known.a[0], a13 = known.a[1], a23 = known.a[2];
  const double b12 = known.b[0], b13 = known.b[1], b23 = known.b[2];
  // A quadratic equation for tau = l2 / l1.
  const double qa = (a13 - a12) * w1 * w1 - a12 * b13 * w1 - a12;
  const double qb = a13 * b12 * w1 - a12 * b13 * w0 - 2.0 * w0 * w1 * (a12 - a13);
  const double qc = (a13 - a12) * w0 * w0 + a13 * b12 * w0 + a13;
  // Rounding can make a double root complex: count it as real.
  const double discriminant = qb * qb - 4.0 * qa * qc;
  if (discriminant < -1e-12 * qb * qb || qa == 0.0) return;

  const double root = std::sqrt(std::max(0.0, discriminant));
  for (const double sign : {-1.0, 1.0}) {
    const double tau = (-qb + sign * root) / (2.0 * qa);
    const double share = 1.0 + tau * (tau + b23);
    if (!(tau > 0.0) || !(share > 0.0)) continue;
    const double l1 = std::sqrt(a23 / share);
    const Eigen::Vector3d l((w0 + w1 * tau) * l1, l1, tau * l1);
    if (!(l[0] > 0.0)) continue;
    const Eigen::Vector3d fine = polished(l, known);
    if (fine.allFinite() && fine.minCoeff() > 0.0) solutions.push_back(fine);
  }
}

std::vector<Eigen::Vector3d> solve_distances(const Distances& known) {
  std::vector<Eigen::Vector3d> solutions;
  const auto planes = plane_pair(known);
  if (!planes) return solutions;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(*planes);
  // The eigenvalue 0 is between the others, which have opposite signs.
  const double low = eigen.eigenvalues()[0], high = eigen.eigenvalues()[2];
  const bool is_low_larger = -low > high;
  const Eigen::Vector3d v0 = eigen.eigenvectors().col(is_low_larger ? 0 : 2);
  const Eigen::Vector3d v1 = eigen.eigenvectors().col(is_low_larger ? 2 : 0);
  const double ratio = is_low_larger ? -high / low : -low / high;

  const double v = std::sqrt(std::max(0.0, ratio));
  for (const double s : {v, -v}) {
    const Eigen::Vector3d plane = v0 - s * v1;
    if (std::abs(plane[0]) < kDegenerate) continue;
    solve_in_plane(-plane[1] / plane[0], -plane[2] / plane[0], known, solutions);
  }
  return solutions;
}

/// Three vectors that rotate with the triangle: two sides and the normal.
Eigen::Matrix3d sides(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1,
                      const Eigen::Vector3d& p2) {
  Eigen::Matrix3d m;
  m << p0 - p1, p0 - p2, (p0 - p1).cross(p0 - p2);
  return m;
}

}  // namespace

std::vector<Eigen::Isometry3d> solve_three_points(const std::array<PointSighting, 3>& sightings) {
  const auto& [s0, s1, s2] = sightings;
  const Eigen::Matrix3d in_map = sides(s0.point_m, s1.point_m, s2.point_m);
  const double area = in_map.col(2).norm();
  std::vector<Eigen::Isometry3d> poses;
  if (!(area > 1e-9 * (in_map.col(0).squaredNorm() + in_map.col(1).squaredNorm()))) return poses;

  Distances known;
  known.a << in_map.col(0).squaredNorm(), in_map.col(1).squaredNorm(),
      (s1.point_m - s2.point_m).squaredNorm();
  known.b << -2.0 * s0.bearing.dot(s1.bearing), -2.0 * s0.bearing.dot(s2.bearing),
      -2.0 * s1.bearing.dot(s2.bearing);

  const Eigen::Matrix3d map_sides = in_map.inverse();
  for (const Eigen::Vector3d& l : solve_distances(known)) {
    const Eigen::Vector3d p0 = l[0] * s0.bearing;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = sides(p0, l[1] * s1.bearing, l[2] * s2.bearing) * map_sides;
    // A Newton iteration that did not converge gives no rotation.
    const Eigen::Matrix3d off = pose.linear().transpose() * pose.linear();
    if (!off.isApprox(Eigen::Matrix3d::Identity(), 1e-6)) continue;
    pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
    pose.translation() = p0 - pose.linear() * s0.point_m;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace understory::geometry
