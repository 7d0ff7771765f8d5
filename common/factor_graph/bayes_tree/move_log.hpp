// Variables moved by one solve, with distance and earlier value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/factor_graph/graph/variable.hpp"

namespace understory::factor_graph::bayes_tree {

/// Variables that the present solve moved, each once, with their values before it.
class MoveLog {
 public:
  /// Starts a solve on a graph of this variable capacity: nothing has moved yet.
  void begin(int variable_capacity) {
    ++solve_;
    variables_.clear();
    from_.clear();
    moved_in_.resize(static_cast<std::size_t>(variable_capacity), 0);
    distance_.resize(static_cast<std::size_t>(variable_capacity));
  }
  /// Records a move from `from` by `distance` [own conditional standard deviations]. Of several
  /// moves the first `from` and the largest distance are stored.
  void note(int variable, const graph::Delta& from, double distance) {
    const auto at = static_cast<std::size_t>(variable);
    if (moved_in_[at] != solve_) {
      moved_in_[at] = solve_;
      variables_.push_back(variable);
      from_.push_back(from);
      distance_[at] = 0.0;
    }
    distance_[at] = std::max(distance_[at], distance);
  }

  /// Largest move among these variables [own conditional standard deviations]; 0 = none moved.
  double largest(std::span<const int> variables) const {
    double largest = 0.0;
    for (const int name : variables) {
      const auto at = static_cast<std::size_t>(name);
      if (moved_in_[at] == solve_) largest = std::max(largest, distance_[at]);
    }
    return largest;
  }
  /// The variables that moved, in the order of their first moves.
  const std::vector<int>& variables() const { return variables_; }
  /// Value of each of variables() before the solve.
  const std::vector<graph::Delta>& from() const { return from_; }

 private:
  std::vector<int> variables_;
  std::vector<graph::Delta> from_;
  std::vector<std::uint64_t> moved_in_;  ///< Per variable: number of the solve that moved it last.
  std::vector<double> distance_;         ///< Per variable, of that solve.
  std::uint64_t solve_ = 0;
};

}  // namespace understory::factor_graph::bayes_tree
