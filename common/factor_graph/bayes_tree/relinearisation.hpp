// Selects the factors to be linearised again.
#pragma once

#include <vector>

#include "common/factor_graph/bayes_tree/bayes_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Factor on a limit of deviations for this factor: 1 for relative poses in the plane; in space it
/// allows for residuals that are larger by the root of their number of rows.
double limit_scale(const graph::FactorRecord& factor);

/// All factors of the tree, ordered so that neighbours in the tree are adjacent. O(graph).
std::vector<int> factors_of_tree(const CliqueTree& cliques);

/// Factors to be linearised again, and variables that need a new base of their charts. commit()
/// saves the lists, rollback() restores the saved ones.
class Relinearisation {
 public:
  /// Both references must outlive it.
  Relinearisation(graph::FactorGraph& graph, BayesTree& tree) : graph_(graph), tree_(tree) {}

  /// The next run() linearises the factor.
  void add(int factor);
  /// The next run() makes the variable's estimate its chart's base and linearises its factors.
  void rebase(int variable) { now_.rebase.push_back(variable); }
  /// Call it when the factor is removed from the graph.
  void forget_factor(int factor);
  /// Call it when the variable is removed from the graph.
  void forget_variable(int variable) { std::erase(now_.rebase, variable); }
  /// Linearises the listed factors and marks them in the tree; returns the number of factors.
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
