// Order of elimination, and the sets of variables eliminated together.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_drafts.hpp"
#include "common/factor_graph/bayes_tree/elimination_problem.hpp"
#include "common/factor_graph/bayes_tree/minimum_degree.hpp"

namespace understory::factor_graph::bayes_tree {

/// Plans the elimination of a set of variables connected by elements (factors, separators of
/// subtrees). Variables are numbered from 0 in the order of their dimensions. Keeps its scratch
/// memory.
class CliquePlanner {
 public:
  /// Begins a new problem with these variables [degrees of freedom] and no element.
  void clear(std::span<const int> dimensions) { problem_.clear(dimensions); }
  /// Begins the next element.
  void begin_element() { problem_.begin_element(); }
  /// Adds a variable to the element begun last.
  void add_to_element(int variable) { problem_.add_to_element(variable); }
  /// The variable is to be eliminated after all others.
  void set_last(int variable) { problem_.set_last(variable); }

  /// Orders by exact minimum degree, or by constrained COLAMD for many variables (variables of
  /// set_last() after all others, their neighbours just before: the next update will probably
  /// change these). Finds the separator of each variable, and merges cliques if that saves time. If
  /// the result costs more than 5 Mflop, a nested dissection (of all variables but those of
  /// set_last()) is computed too, and the cheaper order is used. The plan is valid until the next
  /// clear().
  const CliquePlan& plan();

 private:
  void order();
  void order_few();
  bool order_by_dissection();

  EliminationProblem problem_;
  MinimumDegree minimum_degree_;
  std::vector<int> order_;  ///< Variable at each position.
  std::vector<int> column_starts_, row_indices_;
  CliqueDrafts drafts_;
};

}  // namespace understory::factor_graph::bayes_tree
