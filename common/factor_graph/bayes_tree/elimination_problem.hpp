// Variables to be eliminated and their connections.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/dissection.hpp"

namespace understory::factor_graph::bayes_tree {

/// Floating-point operations for eliminating `pivots` from a front with `rest` more rows.
constexpr double elimination_flops(double pivots, double rest) {
  return pivots * (pivots * pivots / 3.0 + pivots * rest + rest * rest);
}

/// Time of one front [us], fitted to the kernel: overhead, memory transfer, elimination.
constexpr double front_time_us(double pivots, double separator) {
  const double size = pivots + separator + 1.0;
  return 0.25 + 0.0006 * size * size + 0.00015 * elimination_flops(pivots, separator + 1.0);
}

/// A planner's input: variables by number, and elements (sets of variables that become neighbours).
class EliminationProblem {
 public:
  /// Groups in the order of elimination.
  enum Group { kOthers = 0, kNeighbours = 1, kLast = 2 };

  /// Begins a new problem with these variables [degrees of freedom] and no element.
  void clear(std::span<const int> dimensions) {
    dimensions_.assign(dimensions.begin(), dimensions.end());
    group_.assign(dimensions.size(), kOthers);
    element_starts_.clear();
    entries_.clear();
  }
  /// Begins the next element.
  void begin_element() { element_starts_.push_back(static_cast<int>(entries_.size())); }
  /// Adds a variable to the element begun last.
  void add_to_element(int variable) { entries_.push_back(variable); }
  /// Puts the variable into the last group.
  void set_last(int variable) { group_[static_cast<std::size_t>(variable)] = kLast; }
  /// Puts other variables that share an element with one of the last group into the group before
  /// it.
  void find_neighbours();

  /// Number of variables.
  int size() const { return static_cast<int>(dimensions_.size()); }
  /// Degrees of freedom of a variable.
  int dimension(int variable) const { return dimensions_[static_cast<std::size_t>(variable)]; }
  /// Group of a variable.
  int group(int variable) const { return group_[static_cast<std::size_t>(variable)]; }
  /// Groups of all variables, in the form of CCOLAMD.
  std::vector<int>& groups() { return group_; }
  /// Number of elements.
  int element_count() const { return static_cast<int>(element_starts_.size()); }
  /// All elements.
  ElementLists elements() const { return {element_starts_, entries_}; }
  /// The variables of one element.
  std::span<const int> element(int number) const { return elements()[number]; }
  /// The variables of all elements, element after element.
  std::span<const int> entries() const { return entries_; }
  /// Lower bound of the cost in any order: elimination of the largest element.
  double least_flops() const;

 private:
  std::vector<int> dimensions_;
  std::vector<int> group_;
  std::vector<int> element_starts_;
  std::vector<int> entries_;
};

}  // namespace understory::factor_graph::bayes_tree
