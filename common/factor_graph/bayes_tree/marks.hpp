// Marks of the cliques that the next elimination must update.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"

namespace understory::factor_graph::bayes_tree {

/// Sets of cliques with outdated structure or numbers. A mark on a clique includes all cliques
/// above it. commit() saves the sets, rollback() restores the saved ones.
class Marks {
 public:
  /// Marks the clique and all above it to be built again. Costs the unmarked part of the path.
  void mark_structure(const CliqueTree& tree, int clique);
  /// Marks the clique and all above it to be computed again; their structure stays.
  void mark_numbers(const CliqueTree& tree, int clique);

  /// True where the structure is marked.
  bool is_structural(int clique) const { return mark(clique) == kStructural; }
  /// True where the numbers alone are marked.
  bool is_dirty(int clique) const { return mark(clique) == kDirty; }
  /// Cliques whose structure is marked, in the order of marking.
  std::span<const int> structural() const { return structural_; }
  /// Cliques whose numbers were marked, in the order of marking; some may be structural since then.
  std::span<const int> dirty() const { return dirty_; }

  /// Adapts to the tree's capacity; new cliques are not marked.
  void resize(int cliques) { mark_.resize(static_cast<std::size_t>(cliques), kClean); }
  /// Forgets all marks.
  void clear();
  /// Saves the sets as they are.
  void commit();
  /// Restores the saved sets, for a tree with `cliques` cliques.
  void rollback(int cliques);

 private:
  enum Mark : char { kClean = 0, kDirty = 1, kStructural = 2 };
  struct Sets {
    std::vector<int> structural;
    std::vector<int> dirty;
  };

  char mark(int clique) const { return mark_[static_cast<std::size_t>(clique)]; }

  std::vector<char> mark_{kClean};  ///< Per clique; at first the root alone.
  std::vector<int> structural_;
  std::vector<int> dirty_;
  Sets saved_;
};

}  // namespace understory::factor_graph::bayes_tree
