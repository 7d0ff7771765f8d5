// Covariances by the paths from the variables' cliques to the root.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Computes covariances from the factorised tree. Keeps its scratch memory between calls; holds no
/// state.
class Covariance {
 public:
  /// Both references must outlive it.
  Covariance(const graph::FactorGraph& graph, const CliqueTree& cliques)
      : graph_(graph), cliques_(cliques) {}

  /// Joint covariance of the variables in the order given, each in its chart (see graph::Delta).
  /// None where a variable is not in the tree or not determined by the measurements. Costs one
  /// triangular solution along the paths to the root.
  std::optional<Eigen::MatrixXd> joint(std::span<const int> variables);

 private:
  void collect_paths(std::span<const int> variables);
  void sort_paths();
  std::optional<int> give_rows();
  void set_right_side(std::span<const int> variables, Eigen::Index rows, Eigen::Index columns);
  void forward(const CliqueRecord& clique);

  const graph::FactorGraph& graph_;
  const CliqueTree& cliques_;
  std::vector<int> found_;        ///< Cliques of the paths in the order of finding.
  std::vector<int> path_;         ///< The same, children first.
  std::vector<char> is_on_path_;  ///< Per clique; zero between calls.
  std::vector<int> pending_;      ///< Per clique: children not yet in `path_`; zero between calls.
  std::vector<int> offset_;       ///< Per variable: its first row in `right_`.
  Eigen::MatrixXd right_;         ///< Rows of the paths' frontal variables.
  Eigen::MatrixXd separator_part_;
};

}  // namespace understory::factor_graph::bayes_tree
