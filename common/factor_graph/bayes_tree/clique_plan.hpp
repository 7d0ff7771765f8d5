// In which order to eliminate variables, and which of them together.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/dissection.hpp"

namespace understory::factor_graph::bayes_tree {

/// Of eliminating so many pivots from a front with so many rows more.
constexpr double elimination_flops(double pivots, double rest) {
  return pivots * (pivots * pivots / 3.0 + pivots * rest + rest * rest);
}

/// Cliques in the order of elimination, children before parents; variables by their numbers in the
/// planner's input.
struct CliquePlan {
  struct Clique {
    int first_row = 0;  ///< In `rows`: frontal variables, then the separator in order.
    int frontal_count = 0;
    int row_count = 0;
    int first_element = kNoElement;  ///< List through `next_element`.
  };
  static constexpr int kNoElement = -1;
  std::vector<Clique> cliques;
  std::vector<int> rows;
  std::vector<int> next_element;
};

/// Plans the elimination of a set of variables that elements (factors, separators of subtrees) tie
/// together. Keeps its scratch memory.
class CliquePlanner {
 public:
  void clear(std::span<const int> dimensions);
  void begin_element() { element_starts_.push_back(static_cast<int>(entries_.size())); }
  void add_to_element(int variable) { entries_.push_back(variable); }
  void set_last(int variable) { group_[static_cast<std::size_t>(variable)] = kLast; }

  /// Orders by constrained COLAMD (those of set_last() after all others, their neighbours just
  /// before: the next update will most likely touch these), finds what each variable
  /// is tied to when its turn comes, and merges cliques where that saves time. Where that costs
  /// much it asks for a nested dissection, too (of all but those of set_last()), and takes what is
  /// less.
  const CliquePlan& plan();

 private:
  struct Draft {
    int first_frontal = 0, last_frontal = 0;  ///< Positions, list through next_frontal_.
    int frontal_count = 0;
    int pivots = 0;
    int first_separator = 0;  ///< In separators_.
    int separator_count = 0;
    int separator_size = 0;
    int next = -1;  ///< Among the children of one parent.
    bool alive = true;
  };
  int size() const { return static_cast<int>(dimensions_.size()); }
  int element_count() const { return static_cast<int>(element_starts_.size()); }
  ElementLists elements() const { return {element_starts_, entries_}; }
  std::span<const int> element(int number) const { return elements()[number]; }
  enum Group { kOthers = 0, kNeighbours = 1, kLast = 2 };
  void find_neighbours();
  void order();
  void order_few();
  double least_flops() const;
  double flops() const;
  bool order_by_dissection();
  void draft_all();
  void sort_elements();
  void draft(int position);
  void merge_children(int position, int first_child);
  void write();

  std::vector<int> dimensions_;
  std::vector<int> group_;
  std::vector<int> element_starts_;
  std::vector<int> entries_;
  std::vector<int> order_;      ///< Variable at each position.
  std::vector<int> positions_;  ///< Of each variable.
  std::vector<int> column_starts_, row_indices_;
  std::vector<int> first_element_;  ///< At each position.
  std::vector<int> marker_;
  std::vector<Draft> drafts_;
  std::vector<int> children_;  ///< At each position: first child draft.
  std::vector<int> next_frontal_;
  std::vector<int> separators_;
  CliquePlan plan_;
};

}  // namespace understory::factor_graph::bayes_tree
