// Computes the numbers of the tree: dense fronts, assembled and factorised.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/bayes_tree/front_kernel.hpp"
#include "common/factor_graph/bayes_tree/marks.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Supernodal multifrontal Cholesky factorisation, one clique at a time. A clique's front is the
/// sum of its factors and of its children's Schur complements. Keeps its scratch memory between
/// calls; holds no state.
class Elimination {
 public:
  /// Both references must outlive it.
  Elimination(const graph::FactorGraph& graph, CliqueTree& cliques)
      : graph_(graph), cliques_(cliques), kernel_(front_kernel()) {}

  /// Lists the cliques whose numbers alone are marked, children first.
  void list_dirty(const Marks& marks, std::vector<int>& computed);
  /// Computes these cliques' columns of L; all cliques below them must be up to date or among them.
  /// A clique's contribution is stored only if computing it again would take long for its size.
  void factorise(std::span<const int> cliques);
  /// Computes the numbers that a rollback could not restore: from the same factors by the same
  /// operations, so that the numbers are the same. The graph must be restored before.
  void restore_lost();

 private:
  void order_by_subtrees(std::span<const int> cliques);
  int compute(const CliqueRecord& clique);
  void assemble(const CliqueRecord& clique);
  void place_rows(const CliqueRecord& clique);
  void add_factors(const CliqueRecord& clique);
  void add_child(int id, int size);
  void find_runs(const CliqueRecord& child, int size);
  void list_missing_children(int id);
  void rebuild_children(int id);
  void store_contribution(int id);
  void judge_contribution(int id);

  const graph::FactorGraph& graph_;
  CliqueTree& cliques_;
  FrontKernel kernel_;
  std::vector<int> pending_;     ///< Per clique: dirty children not yet listed; zero between calls.
  std::vector<char> is_listed_;  ///< Per clique; zero between calls.
  std::vector<int> order_, stack_, missing_;
  std::vector<double> numbers_;  ///< One front: size x size, column-major, lower triangle.
  double* front_ = nullptr;
  std::vector<int> offset_;    ///< Per variable of the graph: its first row.
  std::vector<double> least_;  ///< Per pivot: limit at or below which it has no information.
  std::vector<int> left_out_;
  std::vector<RowRun> runs_;
  std::vector<int> targets_;  ///< Rows of one factor's columns.
};

}  // namespace understory::factor_graph::bayes_tree
