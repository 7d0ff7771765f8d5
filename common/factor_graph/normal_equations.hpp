// The linearised graph: H delta = -g.
#pragma once

#include "common/factor_graph/graph.hpp"
#include "common/factor_graph/sparse_cholesky.hpp"

namespace understory {

/// Normal equations over the variables that some factor touches: poses (3 columns each) first, then
/// points (2 each).
class NormalEquations {
 public:
  /// Finds the variables in use and the pattern. O(factors log factors).
  explicit NormalEquations(const Graph& graph);
  /// Fills in the values at the graph's present estimate; the graph must still have the same
  /// factors. O(factors).
  void linearise(const Graph& graph);

  int size() const { return hessian_.size; }
  const SymmetricSparse& hessian() const { return hessian_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  double chi2() const { return chi2_; }
  /// Hessian with its diagonal scaled by (1 + lambda) (Levenberg-Marquardt).
  SymmetricSparse damped(double lambda) const;
  /// First column of a variable, or -1 where no factor touches it.
  int column(PoseId pose) const { return pose_columns_[index(pose)]; }
  int column(PointId point) const { return point_columns_[index(point)]; }

 private:
  void number_variables(const Graph& graph);
  void build_pattern(const Graph& graph);
  template <typename Block>
  void add_block(std::size_t slot, int first_column, const Block& block);
  void add_diagonal(int column, const Eigen::Ref<const Eigen::MatrixXd>& block);

  SymmetricSparse hessian_;
  Eigen::VectorXd gradient_;
  double chi2_ = 0.0;
  std::vector<int> pose_columns_;
  std::vector<int> point_columns_;
  std::vector<std::size_t> relative_slots_;     ///< Row offset in its columns, per relative pose.
  std::vector<std::size_t> observation_slots_;  ///< Likewise per observation.
};

}  // namespace understory
