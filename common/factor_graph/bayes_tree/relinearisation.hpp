// Which factors are linearised again, and when.
#pragma once

#include <vector>

#include "common/factor_graph/bayes_tree/bayes_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Part of a limit to deviations that holds for this factor: 1 for relative poses in the plane;
/// residuals in space are larger by the root of their number of rows.
double limit_scale(const graph::FactorRecord& factor);

/// All factors that the tree holds, neighbours in it side by side. O(graph).
std::vector<int> factors_of_tree(const CliqueTree& cliques);

/// Factors that wait to be linearised again, and variables that wait for a new base of their
/// charts. commit() saves the lists, rollback() restores the saved ones.
class Relinearisation {
 public:
  /// Works on these two, which must outlive it.
  Relinearisation(graph::FactorGraph& graph, BayesTree& tree) : graph_(graph), tree_(tree) {}

  /// The factor is linearised with the next run().
  void add(int factor);
  /// The variable's estimate becomes its chart's base with the next run(); its factors follow.
  void rebase(int variable) { now_.rebase.push_back(variable); }
  /// The factor leaves the graph.
  void forget_factor(int factor);
  /// The variable leaves the graph.
  void forget_variable(int variable) { std::erase(now_.rebase, variable); }
  /// Linearises what is due and marks it in the tree; returns the number of factors.
  long run();

  /// Saves the lists as they are.
  void commit() { saved_ = now_; }
  /// Restores the saved lists.
  void rollback() { now_ = saved_; }

 private:
  struct Lists {
    std::vector<int> stale;   ///< Factors.
    std::vector<int> rebase;  ///< Variables.
  };

  graph::FactorGraph& graph_;
  BayesTree& tree_;
  Lists now_;
  Lists saved_;
};

}  // namespace understory::factor_graph::bayes_tree
