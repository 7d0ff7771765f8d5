// Back-substitution, as far down the tree as something changes.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/bayes_tree/front_kernel.hpp"
#include "common/factor_graph/bayes_tree/move_log.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Solves for the variables' moves from given cliques downwards and moves them in the graph. Keeps
/// its scratch memory between calls; its only result is the log of the last solve.
class BackSubstitution {
 public:
  /// Works on these two, which must outlive it.
  BackSubstitution(graph::FactorGraph& graph, const CliqueTree& cliques)
      : graph_(graph), cliques_(cliques), kernel_(front_kernel()) {}

  /// Solves `computed` (children first) and what lies below, as long as it changes or, where
  /// `is_whole`, all of it. A variable that would move by less than `threshold` of its own
  /// conditional standard deviation stays.
  void solve(std::span<const int> computed, double threshold, bool is_whole);
  /// What the last solve moved.
  const MoveLog& moves() const { return moves_; }

 private:
  void solve_from(int id, double threshold, bool is_whole);
  void solve_clique(int id, double threshold);
  void move_variables(const CliqueRecord& clique, double threshold);
  void push_children(int id, bool is_whole);

  graph::FactorGraph& graph_;
  const CliqueTree& cliques_;
  FrontKernel kernel_;
  std::vector<char> is_computed_;  ///< Per clique: solved in any case; zero between calls.
  std::vector<double> step_;       ///< One clique's rows.
  std::vector<int> stack_;         ///< Cliques still to be solved.
  MoveLog moves_;
};

}  // namespace understory::factor_graph::bayes_tree
