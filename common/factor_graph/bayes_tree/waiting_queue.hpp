// Cliques whose small changes are passed on by a later update.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace understory::factor_graph::bayes_tree {

/// Cliques at which back-substitution stopped because the change above them was small; first come,
/// first served. commit() saves the queue, rollback() restores the saved one.
class WaitingQueue {
 public:
  /// Appends the clique unless it waits already. `capacity`: the tree's.
  void add(int clique, int capacity);
  /// Takes a clique that leaves the tree out.
  void drop(int clique);
  /// Takes all out.
  void clear();
  /// Calls visit(clique) for the first `slots` entries and takes them out; `visit` may add cliques.
  template <typename Visit>
  void serve(int slots, Visit&& visit);

  /// Saves the queue as it is.
  void commit();
  /// Restores the saved queue, for a tree of this capacity.
  void rollback(int capacity);

 private:
  bool waits(int clique) const { return is_waiting_[static_cast<std::size_t>(clique)] != 0; }

  std::vector<int> waiting_;      ///< With entries of cliques that were dropped.
  std::vector<char> is_waiting_;  ///< Per clique; false of dropped ones.
  std::vector<int> saved_;
};

template <typename Visit>
void WaitingQueue::serve(int slots, Visit&& visit) {
  const auto count = std::min(waiting_.size(), static_cast<std::size_t>(slots));
  for (std::size_t i = 0; i < count; ++i) {
    const int clique = waiting_[i];
    if (!waits(clique)) continue;
    is_waiting_[static_cast<std::size_t>(clique)] = 0;
    visit(clique);
  }
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace understory::factor_graph::bayes_tree
