// The least-squares solution of a graph of the plane, computed whole.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/factor_graph/plane/graph.hpp"

namespace understory::test {

struct BatchSmootherParameters {
  int max_iterations = 8;
  /// A step that moved nothing further than this is the last: Gauss-Newton squares the error, so
  /// some micrometres are left.
  double converged_m = 1e-2;
  double converged_rad = 1e-3;  ///< Likewise for headings.
};

struct BatchUpdate {
  bool ok = false;
  bool converged = false;
  int iterations = 0;
  double chi2 = 0.0;
  std::string error;  ///< Names the variable that the measurements leave undetermined.
};

/// On CHOLMOD: every update solves the whole graph by Gauss-Newton with step control, from the last
/// estimate; one sparse factorisation per iteration. What the incremental smoother is held to.
class BatchSmoother {
 public:
  explicit BatchSmoother(const BatchSmootherParameters& parameters = {});
  ~BatchSmoother();
  BatchSmoother(BatchSmoother&&) noexcept;
  BatchSmoother& operator=(BatchSmoother&&) noexcept;

  /// Variables and factors may be appended freely between updates; values are estimates after
  /// update().
  factor_graph::plane::Graph& graph() { return graph_; }
  const factor_graph::plane::Graph& graph() const { return graph_; }

  /// Remembers the graph as it is; rollback() restores exactly that.
  void checkpoint();
  void rollback();

  /// Variables without any factor are left alone. On an error the values are those before the call.
  BatchUpdate update();

  /// Joint covariance of poses (3 each, right perturbation), then points (2 each), at the last
  /// update's linearisation; none when there was no successful update since the graph changed
  /// shape, or a variable has no factor.
  std::optional<Eigen::MatrixXd> joint_marginal(
      std::span<const factor_graph::plane::PoseId> poses,
      std::span<const factor_graph::plane::PointId> points) const;

 private:
  struct Solver;
  struct Checkpoint;

  BatchSmootherParameters parameters_;
  factor_graph::plane::Graph graph_;
  std::unique_ptr<Solver> solver_;
  std::unique_ptr<Checkpoint> checkpoint_;
};

}  // namespace understory::test
