// New structure for the changed part of the tree.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_plan.hpp"
#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/bayes_tree/marks.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Replaces the cliques whose structure is marked by newly planned ones, and links the unchanged
/// subtrees below them to the new ones (iSAM2, Kaess et al. 2012). Keeps its scratch memory between
/// calls; holds no state.
class Restructuring {
 public:
  /// Both references must outlive it.
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
  std::vector<int> affected_;         ///< Variables whose elimination is planned again.
  std::vector<int> affected_at_;      ///< Per variable of the graph: its index in `affected_`.
  std::vector<int> factors_;          ///< Factors of the clique being built.
  std::vector<int> element_factors_;  ///< The planner's first elements: factors ...
  std::vector<int> orphans_;          ///< ... and after them the unchanged subtrees.
  std::vector<int> dimensions_;       ///< Dimensions of `affected_`.
};

}  // namespace understory::factor_graph::bayes_tree
