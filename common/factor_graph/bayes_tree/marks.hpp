// Which cliques the next elimination has to bring up to date.
#pragma once

#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"

namespace understory::factor_graph::bayes_tree {

/// Sets of cliques whose structure or whose numbers are out of date. With a clique, all above it
/// are marked. commit() saves the sets, rollback() restores the saved ones.
class Marks {
 public:
  /// The clique and all above it will be built anew. Costs the part of the path not yet marked so.
  void mark_structure(const CliqueTree& tree, int clique);
  /// The clique and all above it will be computed anew; their structure stays.
  void mark_numbers(const CliqueTree& tree, int clique);

  /// True where the structure is marked.
  bool is_structural(int clique) const { return mark(clique) == kStructural; }
  /// True where the numbers alone are marked.
  bool is_dirty(int clique) const { return mark(clique) == kDirty; }
  /// Cliques whose structure is marked, in the order of marking.
  std::span<const int> structural() const { return structural_; }
  /// Cliques whose numbers were marked first, in the order of marking; some may be structural by
  /// now.
  std::span<const int> dirty() const { return dirty_; }

  /// Follows the tree's capacity; new cliques are not marked.
  void resize(int cliques) { mark_.resize(static_cast<std::size_t>(cliques), kClean); }
  /// Forgets all marks.
  void clear();
  /// Saves the sets as they are.
  void commit();
  /// Restores the saved sets, for a tree that now has so many cliques.
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
