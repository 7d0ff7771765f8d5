// The least-squares solution of a graph, kept up to date as the graph grows.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/factor_graph/graph.hpp"

namespace understory {

struct SmootherParameters {
  int max_iterations = 8;
  /// A step that moved nothing further than this is the last: Gauss-Newton squares the error, so
  /// some micrometres are left.
  double converged_m = 1e-2;
  double converged_rad = 1e-3;  ///< Likewise for headings.
};

struct SmootherUpdate {
  bool ok = false;
  bool converged = false;
  int iterations = 0;
  double chi2 = 0.0;
  std::string error;  ///< Names the variable that the measurements leave undetermined.
};

/// Smoother on CHOLMOD: every update solves the whole graph by Gauss-Newton with step control, from
/// the last estimate.
///
/// Cost of an update: one sparse factorisation per iteration. The interface is that of an
/// incremental smoother: add, update, ask for values and marginals, take the last update back.
class Smoother {
 public:
  explicit Smoother(const SmootherParameters& parameters = {});
  ~Smoother();
  Smoother(Smoother&&) noexcept;
  Smoother& operator=(Smoother&&) noexcept;

  /// Variables and factors may be appended freely between updates; values are estimates after
  /// update().
  Graph& graph() { return graph_; }
  const Graph& graph() const { return graph_; }

  /// Remembers the graph as it is; rollback() restores exactly that.
  void checkpoint();
  void rollback();

  /// Variables without any factor are left alone. On an error the values are those before the call.
  SmootherUpdate update();

  /// Joint covariance of poses (3 each, right perturbation), then points (2 each), at the last
  /// update's linearisation; none when there was no successful update since the graph changed
  /// shape, or a variable has no factor.
  std::optional<Eigen::MatrixXd> joint_marginal(std::span<const PoseId> poses,
                                                std::span<const PointId> points) const;

 private:
  struct Solver;
  struct Checkpoint;

  SmootherParameters parameters_;
  Graph graph_;
  std::unique_ptr<Solver> solver_;
  std::unique_ptr<Checkpoint> checkpoint_;
};

}  // namespace understory
