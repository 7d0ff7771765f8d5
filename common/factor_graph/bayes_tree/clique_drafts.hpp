// Makes cliques from an elimination order.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/elimination_problem.hpp"

namespace understory::factor_graph::bayes_tree {

/// Cliques in the order of elimination, children before parents; variables and elements by their
/// numbers in the planner's input.
struct CliquePlan {
  /// One clique: ranges of the lists below.
  struct Clique {
    int first_row = 0;               ///< In `rows`: frontal variables, then the separator in order.
    int frontal_count = 0;           ///< Number of frontal variables.
    int row_count = 0;               ///< Number of all its variables.
    int first_element = kNoElement;  ///< Elements assembled here; list through `next_element`.
  };
  static constexpr int kNoElement = -1;  ///< End of a list of elements.

  std::vector<Clique> cliques;
  std::vector<int> rows;          ///< Variables.
  std::vector<int> next_element;  ///< Per element.
};

/// Symbolic elimination in a given order: finds each variable's separator, and merges a clique into
/// its parent if that saves time. Keeps its scratch memory.
class CliqueDrafts {
 public:
  /// Drafts cliques for the variables in this order, which must outlive write().
  void draft_all(const EliminationProblem& problem, std::span<const int> order);
  /// Floating-point operations of the drafted elimination.
  double flops() const;
  /// The drafts as a plan, valid until the next draft_all().
  const CliquePlan& write(std::span<const int> order);

 private:
  struct Draft {
    int first_frontal = 0, last_frontal = 0;  ///< Positions; a list through next_frontal_.
    int frontal_count = 0;
    int pivots = 0;
    int first_separator = 0;  ///< Index in separators_.
    int separator_count = 0;
    int separator_size = 0;
    int next = -1;      ///< Next child of the same parent.
    bool alive = true;  ///< Not merged into its parent.
  };

  void sort_elements(const EliminationProblem& problem, std::span<const int> order);
  void draft(const EliminationProblem& problem, std::span<const int> order, int position);
  void merge_children(int position, int first_child);
  void append(const Draft& draft, std::span<const int> order);

  std::vector<int> positions_;      ///< Position of each variable.
  std::vector<int> first_element_;  ///< First element at each position.
  std::vector<int> marker_;         ///< For each position: the last position connected to it.
  std::vector<Draft> drafts_;       ///< Draft at each position.
  std::vector<int> children_;       ///< For each position: first child draft.
  std::vector<int> next_frontal_;
  std::vector<int> separators_;  ///< Positions.
  CliquePlan plan_;
};

}  // namespace understory::factor_graph::bayes_tree
