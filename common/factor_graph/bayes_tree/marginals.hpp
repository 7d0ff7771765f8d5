// Marginal covariances of many variables in one pass from the root.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Computes the marginals of single variables from the factorised tree: from the root downwards a
/// clique's covariance follows from its separator's, which is part of its parent's (Golub &
/// Plemmons 1980; Kaess & Dellaert, "Covariance recovery from a square root information matrix",
/// RAS 57, 2009). Keeps its scratch memory between calls; holds no state.
class Marginals {
 public:
  /// Called with a variable and its covariance in its chart (see graph::Delta).
  using Visit = std::function<void(int, const Eigen::Ref<const Eigen::MatrixXd>&)>;

  /// Both references must outlive it.
  Marginals(const graph::FactorGraph& graph, const CliqueTree& cliques)
      : graph_(graph), cliques_(cliques) {}

  /// Visits each of the variables that is in the tree once, in no defined order. False, and some
  /// are not visited, where the measurements do not determine a variable on the way. Costs about
  /// one elimination of the cliques between the variables and the root; for all variables one
  /// factorisation.
  bool visit(std::span<const int> variables, const Visit& found);

 private:
  void mark(std::span<const int> variables);
  void expand(const CliqueRecord& clique, const Eigen::MatrixXd& of_separator);
  void report(const CliqueRecord& clique, const Visit& found) const;
  void hand_down(const CliqueRecord& clique);

  /// A waiting clique and the covariance of its separator.
  struct Waiting {
    int clique = 0;
    Eigen::MatrixXd of_separator;
  };

  const graph::FactorGraph& graph_;
  const CliqueTree& cliques_;
  std::vector<char> is_needed_;  ///< Per clique: on a path to the root; zero between calls.
  std::vector<char> is_wanted_;  ///< Per variable; zero between calls.
  std::vector<int> needed_;      ///< Cliques marked in `is_needed_`.
  std::vector<int> offset_;      ///< Per variable: its first row in `covariance_`.
  std::vector<Waiting> waiting_;
  Eigen::MatrixXd
      covariance_;  ///< Covariance of the present clique: frontal variables, then separator.
  Eigen::MatrixXd inverse_;  ///< Inverse of its L.
  Eigen::MatrixXd gain_;     ///< d(frontal variables) / d(separator).
};

}  // namespace understory::factor_graph::bayes_tree
