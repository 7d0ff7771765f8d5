// Back-substitution down the tree, as far as values change.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/bayes_tree/front_kernel.hpp"
#include "common/factor_graph/bayes_tree/move_log.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Solves for the variables' changes from given cliques downwards and applies them to the graph.
/// Keeps its scratch memory between calls; its only result is the log of the last solve.
class BackSubstitution {
 public:
  /// Both references must outlive it.
  BackSubstitution(graph::FactorGraph& graph, const CliqueTree& cliques)
      : graph_(graph), cliques_(cliques), kernel_(front_kernel()) {}

  /// Solves `computed` (children first) and the cliques below while values change, or all of them
  /// if `is_whole`. A variable that would move by less than `threshold` of its own conditional
  /// standard deviation stays.
  void solve(std::span<const int> computed, double threshold, bool is_whole);
  /// Variables moved by the last solve.
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
  std::vector<double> step_;       ///< Rows of one clique.
  std::vector<int> stack_;         ///< Cliques still to be solved.
  MoveLog moves_;
};

}  // namespace understory::factor_graph::bayes_tree
