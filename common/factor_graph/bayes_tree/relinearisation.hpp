// Which factors are linearised again, and when.
#pragma once

#include <vector>

#include "common/factor_graph/bayes_tree/bayes_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Part of a limit to deviations that holds for this factor: 1 for relative poses in the plane;
/// residuals in space are larger by the root of their number of rows.
double limit_scale(const graph::FactorRecord& factor);

/// Factors whose linearisations are off by more than `limit` [sigmas] times limit_scale(),
/// neighbours in the tree side by side. O(graph).
std::vector<int> stale_factors(const graph::FactorGraph& graph, const CliqueTree& cliques,
                               double limit);

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
  /// True where no factor is due.
  bool is_empty() const { return now_.stale.empty(); }

  /// Shares these factors (in the tree's order) out among `parts` updates.
  void begin_sweep(std::vector<int> factors, int parts);
  /// The next part becomes due. Its factors are neighbours in the tree, so that each part computes
  /// subtrees of its own anew.
  void take_part_of_sweep();
  /// True while parts are left.
  bool is_sweeping() const { return !now_.sweep.empty(); }
  /// Forgets the parts that are left.
  void end_sweep() { now_.sweep.clear(); }

  /// Saves the lists as they are.
  void commit() { saved_ = now_; }
  /// Restores the saved lists.
  void rollback() { now_ = saved_; }

 private:
  struct Lists {
    std::vector<int> stale;   ///< Factors.
    std::vector<int> rebase;  ///< Variables.
    std::vector<int> sweep;   ///< Factors, the next part behind.
    int sweep_part = 0;       ///< Number of factors per part.
  };

  graph::FactorGraph& graph_;
  BayesTree& tree_;
  Lists now_;
  Lists saved_;
};

}  // namespace understory::factor_graph::bayes_tree
