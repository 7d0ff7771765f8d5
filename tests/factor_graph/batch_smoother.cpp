#include "tests/factor_graph/batch_smoother.hpp"

#include <algorithm>
#include <cmath>

#include "tests/factor_graph/normal_equations.hpp"

namespace understory::test {
namespace {

constexpr double kFirstDamping = 1e-6;
constexpr double kMaxDamping = 1e6;
/// chi^2 may rise by rounding at the optimum.
constexpr double kRoundingRise = 1e-9;

std::string undetermined(const factor_graph::plane::Graph& graph, const NormalEquations& equations,
                         int column) {
  for (std::uint32_t i = 0; i < graph.poses.size(); ++i) {
    const int first = equations.column(factor_graph::plane::PoseId(i));
    if (first >= 0 && column >= first && column < first + 3) {
      return "pose " + std::to_string(i) + " is not determined by the measurements";
    }
  }
  for (std::uint32_t i = 0; i < graph.points.size(); ++i) {
    const int first = equations.column(factor_graph::plane::PointId(i));
    if (first >= 0 && column >= first && column < first + 2) {
      return "point " + std::to_string(i) + " is not determined by the measurements";
    }
  }
  return "column " + std::to_string(column) + " is not determined by the measurements";
}

struct StepSize {
  double position_m = 0.0;
  double heading_rad = 0.0;
};

StepSize retract(factor_graph::plane::Graph& graph, const NormalEquations& equations,
                 const Eigen::VectorXd& delta) {
  StepSize size;
  for (std::uint32_t i = 0; i < graph.poses.size(); ++i) {
    const int column = equations.column(factor_graph::plane::PoseId(i));
    if (column < 0) continue;
    const Eigen::Vector3d xi = delta.segment<3>(column);
    graph.poses[i] = graph.poses[i] * geometry::SE2::Exp(xi);
    size.position_m = std::max(size.position_m, xi.head<2>().cwiseAbs().maxCoeff());
    size.heading_rad = std::max(size.heading_rad, std::abs(xi.z()));
  }
  for (std::uint32_t i = 0; i < graph.points.size(); ++i) {
    const int column = equations.column(factor_graph::plane::PointId(i));
    if (column < 0) continue;
    graph.points[i] += delta.segment<2>(column);
    size.position_m = std::max(size.position_m, delta.segment<2>(column).cwiseAbs().maxCoeff());
  }
  return size;
}

}  // namespace

struct BatchSmoother::Solver {
  std::unique_ptr<NormalEquations> equations;
  factor_graph::batch::SparseCholesky cholesky;
  bool factorised = false;  ///< The factor belongs to `equations` as they are.
};

struct BatchSmoother::Checkpoint {
  factor_graph::plane::Graph graph;
};

BatchSmoother::BatchSmoother(const BatchSmootherParameters& parameters)
    : parameters_(parameters), solver_(std::make_unique<Solver>()) {}
BatchSmoother::~BatchSmoother() = default;
BatchSmoother::BatchSmoother(BatchSmoother&&) noexcept = default;
BatchSmoother& BatchSmoother::operator=(BatchSmoother&&) noexcept = default;

void BatchSmoother::checkpoint() { checkpoint_ = std::make_unique<Checkpoint>(Checkpoint{graph_}); }

void BatchSmoother::rollback() {
  if (checkpoint_) graph_ = checkpoint_->graph;
  solver_->factorised = false;
}

BatchUpdate BatchSmoother::update() {
  BatchUpdate result;
  Solver& solver = *solver_;
  solver.factorised = false;
  solver.equations = std::make_unique<NormalEquations>(graph_);
  NormalEquations& equations = *solver.equations;
  const std::vector<geometry::SE2> first_poses = graph_.poses;
  const std::vector<Eigen::Vector2d> first_points = graph_.points;
  equations.linearise(graph_);
  double damping = 0.0;
  while (result.iterations < parameters_.max_iterations && !result.converged) {
    ++result.iterations;
    const int bad = damping == 0.0 ? solver.cholesky.factorise(equations.hessian())
                                   : solver.cholesky.factorise(equations.damped(damping));
    if (bad >= 0) {
      graph_.poses = first_poses;
      graph_.points = first_points;
      result.error = undetermined(graph_, equations, bad);
      return result;
    }
    solver.factorised = damping == 0.0;
    const Eigen::VectorXd delta = -solver.cholesky.solve(equations.gradient());
    const std::vector<geometry::SE2> poses = graph_.poses;
    const std::vector<Eigen::Vector2d> points = graph_.points;
    const StepSize size = retract(graph_, equations, delta);
    const double after = chi2(graph_);
    if (!std::isfinite(after) || after > equations.chi2() * (1.0 + kRoundingRise) + kRoundingRise) {
      graph_.poses = poses;
      graph_.points = points;
      damping = damping == 0.0 ? kFirstDamping : 100.0 * damping;
      if (damping > kMaxDamping) break;
      continue;
    }
    result.converged =
        size.position_m < parameters_.converged_m && size.heading_rad < parameters_.converged_rad;
    damping = 0.0;
    if (!result.converged && result.iterations < parameters_.max_iterations) {
      equations.linearise(graph_);
      solver.factorised = false;
    }
  }
  result.chi2 = chi2(graph_);
  result.ok = true;
  return result;
}

std::optional<Eigen::MatrixXd> BatchSmoother::joint_marginal(
    std::span<const factor_graph::plane::PoseId> poses,
    std::span<const factor_graph::plane::PointId> points) const {
  if (!solver_->factorised) return std::nullopt;
  const NormalEquations& equations = *solver_->equations;
  std::vector<int> columns;
  for (const factor_graph::plane::PoseId pose : poses) {
    const int first = equations.column(pose);
    if (first < 0) return std::nullopt;
    for (int k = 0; k < 3; ++k) columns.push_back(first + k);
  }
  for (const factor_graph::plane::PointId point : points) {
    const int first = equations.column(point);
    if (first < 0) return std::nullopt;
    for (int k = 0; k < 2; ++k) columns.push_back(first + k);
  }
  const auto count = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(equations.size(), count);
  for (Eigen::Index k = 0; k < count; ++k) right(columns[static_cast<std::size_t>(k)], k) = 1.0;
  const Eigen::MatrixXd solution = solver_->cholesky.solve(right);
  Eigen::MatrixXd result(count, count);
  for (Eigen::Index r = 0; r < count; ++r)
    result.row(r) = solution.row(columns[static_cast<std::size_t>(r)]);
  return 0.5 * (result + result.transpose());
}

}  // namespace understory::test
