// Back-substitution, as far down the tree as something changes.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/bayes_tree/front_kernel.hpp"
#include "common/factor_graph/bayes_tree/move_log.hpp"
#include "common/factor_graph/bayes_tree/waiting_queue.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// When back-substitution stops. Distances in a variable's own (conditional) standard deviations.
struct MoveLimits {
  double finest = 0.0;    ///< A variable that would move by less stays.
  double at_once = 0.0;   ///< Below changes that are all smaller, cliques wait in the queue.
  int slots = 0;          ///< Number of waiting cliques that one solve serves.
  bool is_whole = false;  ///< All cliques are visited; none waits.
};

/// Solves for the variables' moves from given cliques downwards and moves them in the graph. Keeps
/// its scratch memory between calls; its only result is the log of the last solve.
class BackSubstitution {
 public:
  /// Works on these three, which must outlive it.
  BackSubstitution(graph::FactorGraph& graph, const CliqueTree& cliques, WaitingQueue& waiting)
      : graph_(graph), cliques_(cliques), waiting_(waiting), kernel_(front_kernel()) {}

  /// Solves `computed` (children first), what lies below as long as it changes, and the first of
  /// the waiting queue. The far end of a large map follows small changes some updates later: so the
  /// cost does not grow with the map.
  void solve(std::span<const int> computed, const MoveLimits& limits);
  /// What the last solve moved.
  const MoveLog& moves() const { return moves_; }

 private:
  void solve_from(int id, const MoveLimits& limits);
  void solve_clique(int id, double finest);
  void move_variables(const CliqueRecord& clique, double finest);
  void push_children(int id, const MoveLimits& limits);

  graph::FactorGraph& graph_;
  const CliqueTree& cliques_;
  WaitingQueue& waiting_;
  FrontKernel kernel_;
  std::vector<char> is_computed_;  ///< Per clique: solved in any case; zero between calls.
  std::vector<double> step_;       ///< One clique's rows.
  std::vector<int> stack_;         ///< Cliques still to be solved.
  MoveLog moves_;
};

}  // namespace understory::factor_graph::bayes_tree
