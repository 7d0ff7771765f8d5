// The factorised graph (the Bayes tree of iSAM2, Kaess et al. 2012).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/back_substitution.hpp"
#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/bayes_tree/covariance.hpp"
#include "common/factor_graph/bayes_tree/elimination.hpp"
#include "common/factor_graph/bayes_tree/incremental_parameters.hpp"
#include "common/factor_graph/bayes_tree/marginals.hpp"
#include "common/factor_graph/bayes_tree/marks.hpp"
#include "common/factor_graph/bayes_tree/restructuring.hpp"

namespace understory::factor_graph::bayes_tree {

/// A factor graph as a tree of dense fronts: puts together its structure, what is out of date in
/// it, and the steps that bring it up to date. State: cliques and marks; all else is scratch
/// memory of the steps.
class BayesTree {
 public:
  /// A tree of this graph, which must outlive it; empty until eliminate(). `undo_bytes`: see
  /// CliqueTree.
  explicit BayesTree(graph::FactorGraph& graph, std::size_t undo_bytes = kUndoBytes);

  /// Marks the variable's clique and all above it to be built again.
  void mark_structure(int variable);
  /// Marks the factor's clique and all above it to be computed again.
  void mark_numbers(int factor);
  /// Marks everything to be built again.
  void mark_everything();
  /// Removes a factor from its clique and marks the clique.
  void detach(int factor);

  /// Brings the marked part up to date. `fresh`: factors that no clique holds yet. `last`:
  /// variables to be eliminated as late as possible. Gives its floating-point operations.
  double eliminate(std::span<const int> fresh, std::span<const int> last);

  /// Back-substitution from the cliques that eliminate() computed, while values change. Moves the
  /// graph's variables; a variable that would move by less than `threshold` [own conditional
  /// standard deviations] stays.
  void solve(double threshold) { back_substitution_.solve(computed_, threshold, false); }
  /// The same through the whole tree.
  void solve_everything(double threshold);
  /// Variables that the last solve moved, each once.
  const std::vector<int>& changed() const { return back_substitution_.moves().variables(); }
  /// Earlier value of each of changed().
  const std::vector<graph::Delta>& changed_from() const {
    return back_substitution_.moves().from();
  }

  /// See Covariance::joint().
  std::optional<Eigen::MatrixXd> joint_covariance(std::span<const int> variables) {
    return covariance_.joint(variables);
  }
  /// See Marginals::visit().
  bool visit_marginals(std::span<const int> variables, const Marginals::Visit& found) {
    return marginals_.visit(variables, found);
  }
  /// Variables that the measurements leave undetermined. O(cliques) where there are any.
  std::vector<int> undetermined() const;
  /// The cliques.
  const CliqueTree& cliques() const { return cliques_; }
  /// Floating-point operations of one factorisation of the whole tree.
  double total_flops() const { return cliques_.total_flops(); }

  /// Makes all changes final. `is_whole`: all factors of the graph are eliminated.
  void commit(bool is_whole);
  /// Restores the state of the last commit() exactly, at the cost of the changes. The graph must be
  /// restored before.
  void rollback();

 private:
  graph::FactorGraph& graph_;
  CliqueTree cliques_;
  Marks marks_;
  std::vector<int> computed_;  ///< Cliques that the last eliminate() computed, children first.
  Restructuring restructuring_;
  Elimination elimination_;
  BackSubstitution back_substitution_;
  Covariance covariance_;
  Marginals marginals_;
};

}  // namespace understory::factor_graph::bayes_tree
