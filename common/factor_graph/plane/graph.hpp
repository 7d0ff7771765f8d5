// Poses and points of the plane, and the measurements between them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::factor_graph::plane {

/// Index among the poses of a graph.
enum class PoseId : std::uint32_t {};
/// Index among the points of a graph.
enum class PointId : std::uint32_t {};
/// Index among the scalars of a graph.
enum class ScalarId : std::uint32_t {};
/// The index itself.
constexpr std::uint32_t index(PoseId id) { return static_cast<std::uint32_t>(id); }
/// The index itself.
constexpr std::uint32_t index(PointId id) { return static_cast<std::uint32_t>(id); }
/// The index itself.
constexpr std::uint32_t index(ScalarId id) { return static_cast<std::uint32_t>(id); }

/// Measured pose: (x, y, theta) of mean^-1 * pose ~ N(0, information^-1).
struct PosePrior {
  PoseId pose{};
  geometry::SE2 mean;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

/// Measured motion between two poses: (x, y, theta) of a_T_b^-1 * pose_a^-1 * pose_b ~ N(0,
/// information^-1).
struct RelativePose {
  PoseId a{};
  PoseId b{};
  geometry::SE2 a_T_b;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

/// A RelativePose whose rotation was measured by an instrument with a bias, a scalar [rad/s], for
/// `seconds`.
struct BiasedRelativePose {
  RelativePose motion;
  ScalarId bias{};
  double seconds = 0.0;
};

/// Measured scalar: scalar - mean ~ N(0, 1 / information).
struct ScalarPrior {
  ScalarId scalar{};
  double mean = 0.0;
  double information = 0.0;
};

/// Drift of a scalar: b - a ~ N(0, 1 / information).
struct ScalarStep {
  ScalarId a{};
  ScalarId b{};
  double information = 0.0;
};

/// Measured point: point - mean ~ N(0, information^-1).
struct PointPrior {
  PointId point{};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
};

/// A point observed from a pose, Cartesian: pose^-1 * point - position ~ N(0, information^-1), in
/// the frame of the pose.
struct PointObservation {
  PoseId pose{};
  PointId point{};
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
};

/// The variables' values and the factors. Plain data: solvers read it, callers add to it.
struct Graph {
  std::vector<geometry::SE2> poses;
  std::vector<Eigen::Vector2d> points;
  std::vector<PosePrior> pose_priors;
  std::vector<RelativePose> relative_poses;
  std::vector<PointPrior> point_priors;
  std::vector<PointObservation> observations;
  /// Biases of instruments, each in a unit of its own.
  std::vector<double> scalars;
  std::vector<BiasedRelativePose> biased_relative_poses;
  std::vector<ScalarPrior> scalar_priors;
  std::vector<ScalarStep> scalar_steps;

  /// Appends a pose.
  PoseId add_pose(const geometry::SE2& initial);
  /// Appends a point [m].
  PointId add_point(const Eigen::Vector2d& initial);
  /// Value of a pose.
  const geometry::SE2& operator[](PoseId id) const { return poses[index(id)]; }
  /// Value of a scalar.
  double operator[](ScalarId id) const { return scalars[index(id)]; }
  /// Value of a point [m].
  const Eigen::Vector2d& operator[](PointId id) const { return points[index(id)]; }
};

/// Whitened squared error of one factor at the graph's values.
double chi2(const Graph& graph, const PosePrior& factor);
/// As for PosePrior.
double chi2(const Graph& graph, const RelativePose& factor);
/// As for PosePrior.
double chi2(const Graph& graph, const PointPrior& factor);
/// As for PosePrior.
double chi2(const Graph& graph, const BiasedRelativePose& factor);
/// As for PosePrior.
double chi2(const Graph& graph, const ScalarPrior& factor);
/// As for PosePrior.
double chi2(const Graph& graph, const ScalarStep& factor);
/// As for PosePrior.
double chi2(const Graph& graph, const PointObservation& factor);
/// The measured motion corrected for the bias [rad/s] of the yaw rate: the heading is reduced by
/// bias * seconds, the path is rotated back by half of that.
geometry::SE2 at_true_rate(const geometry::SE2& measured, double bias, double seconds);
/// Sum over all factors. O(factors).
double chi2(const Graph& graph);

/// d(residual)/d(right perturbation of the pose), d(residual)/d(point): residual = pose^-1 * point
/// - position.
struct ObservationJacobian {
  Eigen::Vector2d residual;  ///< [m]
  Eigen::Matrix<double, 2, 3> pose;
  Eigen::Matrix2d point;
};
/// Linearises at the graph's values, not whitened.
ObservationJacobian linearise(const Graph& graph, const PointObservation& factor);
/// Linearises pose^-1 * point, with position zero.
ObservationJacobian linearise(const geometry::SE2& pose, const Eigen::Vector2d& point);

/// Residual of a relative pose with its Jacobians; 3 x 3 each, right perturbations.
struct RelativePoseJacobian {
  Eigen::Vector3d residual;  ///< x, y [m], theta [rad]
  Eigen::Matrix3d a;
  Eigen::Matrix3d b;
};
/// Linearises at the graph's values, not whitened.
RelativePoseJacobian linearise(const Graph& graph, const RelativePose& factor);

}  // namespace understory::factor_graph::plane
