#include "eval/baselines/mapper/graph.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <map>

#include "common/geometry/se2.hpp"

namespace understory::eval::baselines::mapper {
namespace {

constexpr double kInformation = 100.0;

/// R(theta)^T
Eigen::Matrix2d rotated_back(double theta) {
  Eigen::Matrix2d r;
  r << std::cos(theta), std::sin(theta), -std::sin(theta), std::cos(theta);
  return r;
}

/// d R(theta)^T / d theta
Eigen::Matrix2d rotated_back_derivative(double theta) {
  Eigen::Matrix2d r;
  r << -std::sin(theta), std::cos(theta), -std::cos(theta), -std::sin(theta);
  return r;
}

Eigen::Vector2d landmark_residual(const Eigen::Vector3d& pose, const Eigen::Vector2d& landmark,
                                  const Eigen::Vector2d& measured) {
  return rotated_back(pose.z()) * (landmark - pose.head<2>()) - measured;
}

/// The normal equations with the landmarks still in: their block is diagonal, since the derivative
/// of an edge by its landmark is a rotation.
struct NormalEquations {
  Eigen::MatrixXd poses;                 ///< 3P x 3P
  Eigen::VectorXd pose_gradient;         ///< 3P
  std::vector<double> landmark_weights;  ///< Times I.
  std::vector<Eigen::Vector2d> landmark_gradients;
  /// Per landmark: pose -> 3 x 2 block. Two edges from one pose add up here, so the matrix is
  /// symmetric by construction.
  std::vector<std::map<std::uint32_t, Eigen::Matrix<double, 3, 2>>> couplings;
};

void add_pose_edge(const Graph& graph, const PoseEdge& edge, NormalEquations& equations) {
  const Eigen::Vector3d& from = graph.poses[edge.from];
  const Eigen::Vector3d& to = graph.poses[edge.to];
  const Eigen::Vector2d moved = to.head<2>() - from.head<2>();
  const Eigen::Matrix2d difference_back = rotated_back(edge.difference.z());
  const Eigen::Matrix2d by_translation = difference_back * rotated_back(from.z());

  Eigen::Vector3d residual;
  residual.head<2>() = by_translation * moved - difference_back * edge.difference.head<2>();
  residual.z() = geometry::wrap_angle(to.z() - from.z() - edge.difference.z());

  Eigen::Matrix<double, 3, 6> jacobian = Eigen::Matrix<double, 3, 6>::Zero();
  jacobian.block<2, 2>(0, 0) = -by_translation;
  jacobian.block<2, 1>(0, 2) = difference_back * rotated_back_derivative(from.z()) * moved;
  jacobian(2, 2) = -1.0;
  jacobian.block<2, 2>(0, 3) = by_translation;
  jacobian(2, 5) = 1.0;

  const Eigen::Matrix<double, 6, 6> square = kInformation * jacobian.transpose() * jacobian;
  const Eigen::Matrix<double, 6, 1> gradient = kInformation * jacobian.transpose() * residual;
  const Eigen::Index i = 3 * static_cast<Eigen::Index>(edge.from);
  const Eigen::Index j = 3 * static_cast<Eigen::Index>(edge.to);
  equations.poses.block<3, 3>(i, i) += square.block<3, 3>(0, 0);
  equations.poses.block<3, 3>(j, j) += square.block<3, 3>(3, 3);
  equations.poses.block<3, 3>(i, j) += square.block<3, 3>(0, 3);
  equations.poses.block<3, 3>(j, i) += square.block<3, 3>(3, 0);
  equations.pose_gradient.segment<3>(i) += gradient.head<3>();
  equations.pose_gradient.segment<3>(j) += gradient.tail<3>();
}

void add_landmark_edge(const Graph& graph, const LandmarkEdge& edge, NormalEquations& equations) {
  const Eigen::Vector3d& pose = graph.poses[edge.pose];
  const Eigen::Vector2d& landmark = graph.landmarks_m[edge.landmark];
  const Eigen::Vector2d residual = landmark_residual(pose, landmark, edge.measured_m);
  const Eigen::Matrix2d by_landmark = rotated_back(pose.z());

  Eigen::Matrix<double, 2, 3> by_pose;
  by_pose.leftCols<2>() = -by_landmark;
  by_pose.col(2) = rotated_back_derivative(pose.z()) * (landmark - pose.head<2>());

  const Eigen::Index i = 3 * static_cast<Eigen::Index>(edge.pose);
  equations.poses.block<3, 3>(i, i) += kInformation * by_pose.transpose() * by_pose;
  equations.pose_gradient.segment<3>(i) += kInformation * by_pose.transpose() * residual;
  equations.landmark_weights[edge.landmark] += kInformation;
  equations.landmark_gradients[edge.landmark] += kInformation * by_landmark.transpose() * residual;
  auto [block, inserted] = equations.couplings[edge.landmark].try_emplace(
      edge.pose, Eigen::Matrix<double, 3, 2>::Zero());
  block->second += kInformation * by_pose.transpose() * by_landmark;
}

NormalEquations assemble(const Graph& graph) {
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(graph.poses.size());
  NormalEquations equations;
  equations.poses = Eigen::MatrixXd::Zero(size, size);
  equations.pose_gradient = Eigen::VectorXd::Zero(size);
  equations.landmark_weights.assign(graph.landmarks_m.size(), 0.0);
  equations.landmark_gradients.assign(graph.landmarks_m.size(), Eigen::Vector2d::Zero());
  equations.couplings.resize(graph.landmarks_m.size());

  if (size > 0) {
    equations.poses.topLeftCorner<3, 3>() += Eigen::Matrix3d::Identity();
  }

  for (const PoseEdge& edge : graph.pose_edges) {
    add_pose_edge(graph, edge, equations);
  }
  for (const LandmarkEdge& edge : graph.landmark_edges) {
    add_landmark_edge(graph, edge, equations);
  }
  return equations;
}

/// Takes the landmarks out of the poses' equations (Schur complement). Only blocks on and below the
/// diagonal are kept up: the factorisation reads no others.
void eliminate_landmarks(NormalEquations& equations) {
  for (std::size_t l = 0; l < equations.couplings.size(); ++l) {
    const auto& blocks = equations.couplings[l];
    for (const auto& [first, a] : blocks) {
      const Eigen::Index i = 3 * static_cast<Eigen::Index>(first);
      const Eigen::Matrix<double, 3, 2> scaled = a / equations.landmark_weights[l];
      equations.pose_gradient.segment<3>(i) -= scaled * equations.landmark_gradients[l];
      for (const auto& [second, b] : blocks) {
        if (second > first) {
          break;
        }
        const Eigen::Index j = 3 * static_cast<Eigen::Index>(second);
        equations.poses.block<3, 3>(i, j) -= scaled * b.transpose();
      }
    }
  }
}

}  // namespace

std::optional<GraphStep> gauss_newton_step(const Graph& graph) {
  NormalEquations equations = assemble(graph);
  eliminate_landmarks(equations);
  const Eigen::LLT<Eigen::MatrixXd> factorisation(equations.poses);
  if (factorisation.info() != Eigen::Success) {
    return std::nullopt;
  }

  const Eigen::VectorXd solution = factorisation.solve(equations.pose_gradient);
  if (!solution.allFinite()) {
    return std::nullopt;
  }

  GraphStep step;
  for (Eigen::Index i = 0; i < solution.size(); i += 3) {
    step.poses.emplace_back(solution.segment<3>(i));
  }
  for (std::size_t l = 0; l < graph.landmarks_m.size(); ++l) {
    Eigen::Vector2d change = equations.landmark_gradients[l];
    for (const auto& [pose, block] : equations.couplings[l]) {
      change -= block.transpose() * step.poses[pose];
    }
    const double weight = equations.landmark_weights[l];
    step.landmarks_m.emplace_back(weight > 0.0 ? Eigen::Vector2d(change / weight)
                                               : Eigen::Vector2d::Zero());
  }
  return step;
}

double newest_pose_error(const Graph& graph, const GraphStep& step, std::size_t first_edge) {
  const std::size_t newest = graph.poses.size() - 1;
  const Eigen::Vector3d pose = graph.poses[newest] - step.poses[newest];
  double error = 0.0;
  for (std::size_t i = first_edge; i < graph.landmark_edges.size(); ++i) {
    const LandmarkEdge& edge = graph.landmark_edges[i];
    if (edge.pose == newest) {
      const Eigen::Vector2d landmark =
          graph.landmarks_m[edge.landmark] - step.landmarks_m[edge.landmark];
      error += kInformation * landmark_residual(pose, landmark, edge.measured_m).squaredNorm();
    }
  }
  return error;
}

void apply(const GraphStep& step, Graph& graph) {
  for (std::size_t i = 0; i < graph.poses.size(); ++i) {
    graph.poses[i] -= step.poses[i];
  }
  for (std::size_t l = 0; l < graph.landmarks_m.size(); ++l) {
    graph.landmarks_m[l] -= step.landmarks_m[l];
  }
}

}  // namespace understory::eval::baselines::mapper
