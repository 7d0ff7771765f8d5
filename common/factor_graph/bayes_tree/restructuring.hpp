// New structure for the part of the tree that changed.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_plan.hpp"
#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/bayes_tree/marks.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Replaces the cliques whose structure is marked by newly planned ones, and hangs the subtrees
/// below them, which stay whole, into the new ones (iSAM2, Kaess et al. 2012). Keeps its scratch
/// memory between calls; holds no state.
class Restructuring {
 public:
  /// Works on these two, which must outlive it.
  Restructuring(graph::FactorGraph& graph, CliqueTree& cliques)
      : graph_(graph), cliques_(cliques) {}

  /// Plans and builds. `fresh`: factors that no clique holds yet; the cliques of their variables
  /// must be marked. `last`: variables to be eliminated as late as possible. Appends the new
  /// cliques to `computed`, children first. Costs what was marked, not what the tree holds.
  void rebuild(std::span<const int> fresh, std::span<const int> last, const Marks& marks,
               std::vector<int>& computed);

 private:
  void collect(std::span<const int> fresh, const Marks& marks);
  void collect_variable(int variable);
  void take_apart(int clique, const Marks& marks);
  const CliquePlan& plan(std::span<const int> last);
  void build(const CliquePlan& plan, std::vector<int>& computed);
  int build_clique(const CliquePlan& plan, int planned);
  void hand_out_elements(const CliquePlan& plan, int planned, int clique);
  void link_to_parent(int clique);

  graph::FactorGraph& graph_;
  CliqueTree& cliques_;
  CliquePlanner planner_;
  std::vector<int> affected_;         ///< Variables whose elimination is planned anew.
  std::vector<int> affected_at_;      ///< Per variable of the graph: its place in `affected_`.
  std::vector<int> factors_;          ///< Of the clique that is built.
  std::vector<int> element_factors_;  ///< The planner's first elements: factors ...
  std::vector<int> orphans_;          ///< ... and behind them the subtrees that stay whole.
  std::vector<int> dimensions_;       ///< Of `affected_`.
};

}  // namespace understory::factor_graph::bayes_tree
