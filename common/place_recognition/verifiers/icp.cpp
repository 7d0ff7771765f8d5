#include "common/place_recognition/verifiers/icp.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace understory::place_recognition::verifiers {
namespace {

using Jacobian = Eigen::Matrix<double, 3, 4>;
using Cube = std::array<int, 3>;

/// The cube of a point; its coordinates are within some km.
Cube cube_of(const Eigen::Vector3d& point, double side_m) {
  const Eigen::Vector3d cell = (point / side_m).array().floor();
  return {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())};
}

constexpr std::size_t kLeastNeighbours = 5;
constexpr std::size_t kLeastPartners = 4;
/// Steps below these count as settled [m], [rad].
constexpr double kSettledM = 1e-4;
constexpr double kSettledRad = 1e-5;
/// Prior that keeps directions without information unchanged.
constexpr double kPriorInformation = 1e-6;

std::vector<Eigen::Vector3d> thinned(std::span<const Eigen::Vector3f> points, std::size_t most) {
  const std::size_t step = std::max<std::size_t>(1, (points.size() + most - 1) / most);
  std::vector<Eigen::Vector3d> kept;
  for (std::size_t i = 0; i < points.size(); i += step) kept.emplace_back(points[i].cast<double>());
  return kept;
}

/// Factor on a covariance because partners change with the motion.
double re_association(IcpMetric metric) {
  if (metric == IcpMetric::kPointToPoint) return 6.0;
  return metric == IcpMetric::kPointToPlane ? 3.0 : 1.0;
}

/// Direction across the surface through some points; zero if there are too few.
Eigen::Vector3d normal_of(std::span<const Eigen::Vector3d> points,
                          std::span<const std::uint32_t> chosen) {
  if (chosen.size() < kLeastNeighbours) return Eigen::Vector3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::uint32_t i : chosen) mean += points[i] / static_cast<double>(chosen.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::uint32_t i : chosen)
    scatter += (points[i] - mean) * (points[i] - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
}

/// Sums over all pairs of one round.
struct NormalEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  std::map<Cube, Eigen::Vector4d> of_cubes;  ///< Gradient of the pairs in each cube.
  std::size_t pairs = 0;

  void add(const Jacobian& jacobian, const Eigen::Matrix3d& weight, const Eigen::Vector3d& off,
           const std::optional<Cube>& cube) {
    const Eigen::Vector4d slope = jacobian.transpose() * weight * off;
    information += jacobian.transpose() * weight * jacobian;
    gradient += slope;
    ++pairs;
    if (cube) of_cubes.try_emplace(*cube, Eigen::Vector4d::Zero()).first->second += slope;
  }

  /// Covariance of the sum of all gradients, with independent cubes.
  Eigen::Matrix4d scatter() const {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    for (const auto& one : of_cubes) sum += one.second * one.second.transpose();
    const auto cubes = static_cast<double>(of_cubes.size());
    return cubes > 4.0 ? Eigen::Matrix4d(cubes / (cubes - 4.0) * sum) : sum;
  }
};

/// One run of ICP: its clouds and its motion so far.
class IcpRun {
 public:
  IcpRun(const IcpCloud& query, const IcpCloud& frame, IcpMetric metric, const geometry::SE2& start)
      : query_(query), frame_(frame), metric_(metric) {
    motion_.plane = start;
  }

  /// One round; false where too few points have a partner.
  bool step(double distance_m) {
    const NormalEquations sums = equations(distance_m, std::nullopt);
    if (sums.pairs < kLeastPartners) return false;
    Eigen::Matrix4d information = sums.information;
    information.diagonal().array() += kPriorInformation;
    last_step_ = -information.ldlt().solve(sums.gradient);
    motion_.plane = motion_.plane * geometry::SE2::Exp(last_step_.head<3>());
    motion_.up_m += last_step_[3];
    return true;
  }
  bool is_settled() const {
    return last_step_.head<2>().norm() < kSettledM && std::abs(last_step_[3]) < kSettledM &&
           std::abs(last_step_[2]) < kSettledRad;
  }
  const LevelMotion& motion() const { return motion_; }

  Eigen::Matrix3d covariance(double distance_m, double cube_m) const {
    const NormalEquations sums = equations(distance_m, cube_m);
    Eigen::Matrix4d information = sums.information;
    information.diagonal().array() += kPriorInformation;
    const Eigen::Matrix4d inverse = information.ldlt().solve(Eigen::Matrix4d::Identity());
    const Eigen::Matrix4d all = re_association(metric_) * inverse * sums.scatter() * inverse;
    return all.topLeftCorner<3, 3>();
  }
  std::size_t inliers(double distance_m) const {
    std::size_t count = 0;
    for (const Eigen::Vector3d& point : query_.points().points_m())
      count += frame_.points().nearest(motion_ * point, distance_m) ? 1 : 0;
    return count;
  }

 private:
  Eigen::Matrix3d weight(std::size_t of_query, std::size_t of_frame,
                         const Eigen::Matrix3d& rotation) const {
    if (metric_ == IcpMetric::kPointToPoint) return Eigen::Matrix3d::Identity();
    if (metric_ == IcpMetric::kPointToPlane) return frame_.across(of_frame);
    const Eigen::Matrix3d both =
        frame_.covariance(of_frame) + rotation * query_.covariance(of_query) * rotation.transpose();
    return both.inverse();
  }

  NormalEquations equations(double distance_m, std::optional<double> cube_m) const {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    rotation.topLeftCorner<2, 2>() = motion_.plane.rotation();
    const auto of_query = query_.points().points_m();
    const auto of_frame = frame_.points().points_m();
    NormalEquations sums;
    for (std::size_t i = 0; i < of_query.size(); ++i) {
      const Eigen::Vector3d moved = motion_ * of_query[i];
      const auto partner = frame_.points().nearest(moved, distance_m);
      if (!partner) continue;
      Jacobian jacobian = Jacobian::Zero();
      jacobian.topLeftCorner<2, 2>() = rotation.topLeftCorner<2, 2>();
      jacobian.col(2).head<2>() =
          rotation.topLeftCorner<2, 2>() * geometry::perpendicular(of_query[i].head<2>());
      jacobian(2, 3) = 1.0;
      sums.add(jacobian, weight(i, *partner, rotation), moved - of_frame[*partner],
               cube_m ? std::optional(cube_of(of_frame[*partner], *cube_m)) : std::nullopt);
    }
    return sums;
  }

  const IcpCloud& query_;
  const IcpCloud& frame_;
  IcpMetric metric_;
  LevelMotion motion_;
  Eigen::Vector4d last_step_ = Eigen::Vector4d::Constant(1e9);
};

}  // namespace

IcpCloud::IcpCloud(std::span<const Eigen::Vector3f> points, const IcpParameters& parameters)
    : points_(thinned(points, parameters.most_points)) {
  const auto all = points_.points_m();
  for (const Eigen::Vector3d& point : all) {
    const auto around =
        points_.nearest(point, parameters.neighbours, parameters.neighbour_radius_m);
    const Eigen::Vector3d normal = normal_of(all, around);
    const Eigen::Matrix3d across = normal * normal.transpose();
    const bool is_round = normal.isZero(0.0);
    across_.push_back(is_round ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : across);
    covariance_.emplace_back(Eigen::Matrix3d::Identity() -
                             (1.0 - parameters.plane_epsilon) * across);
  }
}

Eigen::Vector3d LevelMotion::operator*(const Eigen::Vector3d& point) const {
  Eigen::Vector3d moved;
  moved << plane * Eigen::Vector2d(point.head<2>()), point.z() + up_m;
  return moved;
}

IcpResult icp(const IcpCloud& query, const IcpCloud& frame, IcpMetric metric,
              const geometry::SE2& start, const IcpParameters& parameters) {
  IcpRun run(query, frame, metric, start);
  IcpResult result;
  double distance_m = std::max(parameters.first_distance_m, parameters.last_distance_m);
  for (std::size_t round = 0; round < parameters.most_rounds && !result.converged; ++round) {
    if (!run.step(distance_m)) break;
    const bool is_last = distance_m <= parameters.last_distance_m;
    result.converged = is_last && run.is_settled();
    // The wide rounds need not settle: they only bring the clouds near each other.
    if (!is_last && (run.is_settled() || round % 4 == 3))
      distance_m = std::max(parameters.last_distance_m, 0.5 * distance_m);
  }

  result.frame_T_query = run.motion();
  result.covariance = run.covariance(distance_m, parameters.neighbour_radius_m);
  result.inliers = run.inliers(parameters.inlier_m);
  return result;
}

}  // namespace understory::place_recognition::verifiers
