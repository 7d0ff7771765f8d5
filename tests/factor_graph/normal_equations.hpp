// The linearised graph: H delta = -g.
#pragma once

#include "common/factor_graph/batch/sparse_cholesky.hpp"
#include "common/factor_graph/plane/graph.hpp"

namespace understory::test {

/// Normal equations over the variables that some factor touches: poses (3 columns each) first, then
/// points (2 each).
class NormalEquations {
 public:
  /// Finds the variables in use and the pattern. O(factors log factors).
  explicit NormalEquations(const factor_graph::plane::Graph& graph);
  /// Fills in the values at the graph's present estimate; the graph must still have the same
  /// factors. O(factors).
  void linearise(const factor_graph::plane::Graph& graph);

  int size() const { return hessian_.size; }
  const factor_graph::batch::SymmetricSparse& hessian() const { return hessian_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  double chi2() const { return chi2_; }
  /// Hessian with its diagonal scaled by (1 + lambda) (Levenberg-Marquardt).
  factor_graph::batch::SymmetricSparse damped(double lambda) const;
  /// First column of a variable, or -1 where no factor touches it.
  int column(factor_graph::plane::PoseId pose) const { return pose_columns_[index(pose)]; }
  int column(factor_graph::plane::PointId point) const { return point_columns_[index(point)]; }

 private:
  void number_variables(const factor_graph::plane::Graph& graph);
  void build_pattern(const factor_graph::plane::Graph& graph);
  template <typename Block>
  void add_block(std::size_t slot, int first_column, const Block& block);
  void add_diagonal(int column, const Eigen::Ref<const Eigen::MatrixXd>& block);

  factor_graph::batch::SymmetricSparse hessian_;
  Eigen::VectorXd gradient_;
  double chi2_ = 0.0;
  std::vector<int> pose_columns_;
  std::vector<int> point_columns_;
  std::vector<std::size_t> relative_slots_;     ///< Row offset in its columns, per relative pose.
  std::vector<std::size_t> observation_slots_;  ///< Likewise per observation.
};

}  // namespace understory::test
