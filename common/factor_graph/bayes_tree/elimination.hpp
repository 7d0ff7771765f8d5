// The numbers of the tree: dense fronts, assembled and factorised.
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
  /// Works on these two, which must outlive it.
  Elimination(const graph::FactorGraph& graph, CliqueTree& cliques)
      : graph_(graph), cliques_(cliques), kernel_(front_kernel()) {}

  /// Lists the cliques whose numbers alone are marked, children first.
  void list_dirty(const Marks& marks, std::vector<int>& computed);
  /// Computes the clique's columns of L; its children must be up to date.
  void factorise(int id);
  /// Computes the numbers that a rollback could not restore: from the same factors by the same
  /// operations, so that they are the same. The graph must be the one of then.
  void restore_lost();

 private:
  /// One front at work: size x size, column-major, lower triangle.
  struct Workspace {
    std::vector<double> numbers;
    double* front = nullptr;
    std::vector<int> offset;    ///< Per variable of the graph: its first row.
    std::vector<double> least;  ///< Per pivot: at or below this it has no information.
  };
  /// Rows of a child that are side by side in the parent, too.
  struct Run {
    int from, to, length;
  };

  template <typename IsListed>
  void list_children_first(std::span<const int> cliques, const IsListed& is_listed,
                           std::vector<int>& listed);
  int compute(const CliqueRecord& clique, Workspace& at);
  void store(const CliqueRecord& clique, double* to) const;
  void assemble(const CliqueRecord& clique, Workspace& at);
  void place_rows(const CliqueRecord& clique, Workspace& at) const;
  void add_factors(const CliqueRecord& clique, Workspace& at);
  void add_child(const CliqueRecord& child, Workspace& at, int size);
  void find_runs(const CliqueRecord& child, const Workspace& at, int size);
  template <typename ColumnOf>
  void add_schur(const ColumnOf& column_of, double* front, int size) const;

  const graph::FactorGraph& graph_;
  CliqueTree& cliques_;
  FrontKernel kernel_;
  std::vector<int> pending_;   ///< Per clique: children to be listed before it; zero between calls.
  std::vector<char> is_lost_;  ///< Per clique; zero between calls.
  std::vector<int> restored_;
  Workspace own_space_;
  Workspace leaf_space_;  ///< Of a child that is computed for its parent's sake.
  std::vector<int> left_out_;
  std::vector<Run> runs_;
  std::vector<int> targets_;  ///< Rows of one factor's columns.
};

}  // namespace understory::factor_graph::bayes_tree
