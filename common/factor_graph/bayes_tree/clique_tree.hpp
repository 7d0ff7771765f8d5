// Cliques, their links and memory: the structure of the factorised graph.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/contributions.hpp"
#include "common/factor_graph/bayes_tree/factor_places.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"
#include "common/factor_graph/storage/block_pool.hpp"
#include "common/factor_graph/storage/journaled_table.hpp"

namespace understory::factor_graph::bayes_tree {

/// Variables that are eliminated together, as one dense front.
struct CliqueRecord {
  int parent = graph::kNone;       ///< kNone: no longer in the tree.
  int first_child = graph::kNone;  ///< First of a list through `next_sibling`.
  int next_sibling = graph::kNone;
  int previous_sibling = graph::kNone;
  int factor_count = 0;   ///< Length of `factors`.
  int frontal_count = 0;  ///< Number of frontal variables.
  int row_count = 0;      ///< Number of variables: frontal ones, then the separator.
  int pivots = 0;         ///< Degrees of freedom of the frontal variables.
  int size = 0;           ///< Rows of the front: all degrees of freedom, right-hand side.
  int left_out = 0;       ///< Pivots without information; in the root: number of such cliques.
  /// False: the contribution is dropped as soon as the parent is computed.
  bool keeps_contribution = true;
  float rebuild_us = 0.0F;  ///< Modelled time of computing the contribution again.
  int* rows = nullptr;      ///< Names of the `row_count` variables.
  int* factors = nullptr;   ///< Assembled factors; kNone for a removed one.
  /// size x pivots, column-major: the frontal variables' columns of L; the last row is the
  /// right-hand side.
  double* panel = nullptr;
  std::uint64_t panel_epoch = 0;  ///< Epoch of the tree's journal in which `panel` was written.
  std::uint64_t lost_epoch = 0;   ///< Epoch in which the numbers of the last commit were dropped.

  /// Factors assembled here; kNone for a removed one.
  std::span<const int> assembled() const {
    return {factors, static_cast<std::size_t>(factor_count)};
  }
  /// Length of `panel`.
  std::size_t panel_numbers() const {
    return static_cast<std::size_t>(size) * static_cast<std::size_t>(pivots);
  }
  /// Length of the contribution.
  std::size_t contribution_numbers() const {
    const auto rest = static_cast<std::size_t>(size - pivots);
    return rest * (rest + 1) / 2;
  }
};

/// Floating-point operations of one elimination of this clique.
double flops_of(const CliqueRecord& clique);

/// Owns the cliques, their parent and child links, their assembled factors, and the memory of their
/// names and numbers. Every change is journaled: rollback() restores the tree of the last commit()
/// at the cost of the changes. Numbers of the last commit are stored beside the new ones as far as
/// they fit into `undo_bytes`; a complete second set would be half of the memory. Other numbers
/// that rollback() needs must be computed again. This class does not interpret the numbers.
class CliqueTree {
 public:
  /// Parent of all trees of the forest; holds no variables.
  static constexpr int kRoot = 0;

  explicit CliqueTree(std::size_t undo_bytes);
  CliqueTree(const CliqueTree&) = delete;
  CliqueTree& operator=(const CliqueTree&) = delete;

  /// The clique with this number; numbers are below capacity().
  const CliqueRecord& operator[](int id) const { return cliques_[id]; }
  /// The same for a change, which is journaled. The next add() invalidates references.
  CliqueRecord& edit(int id) { return cliques_.edit(id); }
  /// Upper bound of all clique numbers.
  int capacity() const { return cliques_.size(); }

  /// A new clique with room for `row_count` names in `rows`, in no list yet.
  int add(int frontal_count, int row_count);
  /// Puts `child` at the front of the parent's children.
  void link(int parent, int child);
  /// Sets the factors that a new clique assembles. Their previous cliques must be removed.
  void set_factors(int id, std::span<const int> factors);
  /// Removes a factor from its clique, which keeps its structure until it is built again.
  void remove_factor(int factor);
  /// The clique that assembles the factor; kNone = none.
  int clique_of(int factor) const { return places_[factor].clique; }
  /// Counts the finished structure of a new clique in total_flops().
  void count_work(int id);
  /// Removes these cliques from the tree. The parent of each is the root or among them.
  void remove(std::span<const int> ids);
  /// Memory for the clique's columns of L, which the caller must write again.
  double* writable_panel(int id);
  /// Contributions of cliques to their parents. The caller must write the contribution of a changed
  /// clique again; a rollback drops it.
  Contributions& contributions() { return contributions_; }
  /// The same, read only.
  const Contributions& contributions() const { return contributions_; }
  /// Number of pivots without information that the last elimination of the clique left out.
  void set_left_out(int id, int count);

  /// Number of cliques with pivots without information.
  int undetermined_cliques() const { return cliques_[kRoot].left_out; }
  /// Floating-point operations of one elimination of the whole tree.
  double total_flops() const { return total_flops_; }
  /// Memory taken from the system [bytes].
  std::size_t bytes() const { return panels_.bytes() + names_.bytes() + contributions_.bytes(); }

  /// Makes all changes final. `is_up_to_date`: every clique's numbers follow from its factors and
  /// children, so that they can be computed again; if false, all numbers are stored for a rollback.
  void commit(bool is_up_to_date);
  /// Restores the state of the last commit(), except the numbers of the cliques in lost().
  void rollback();
  /// Cliques whose numbers the last rollback() could not restore; their parents may be among them.
  std::span<const int> lost() const { return lost_; }
  /// Memory for the numbers of one of lost().
  double* lost_panel(int id) { return cliques_[id].panel; }

 private:
  bool keeps_for_undo(const CliqueRecord& clique);
  void drop_panel(CliqueRecord& clique);
  void free_blocks(const CliqueRecord& clique);
  void unlink_from_root(int child);
  void put_factors_back();
  void count_undetermined(int change);

  storage::JournaledTable<CliqueRecord> cliques_;
  storage::BlockPool<double> panels_;
  storage::BlockPool<int> names_;  ///< Names of variables and factors.
  FactorPlaces places_;
  struct TakenOut {
    int factor;
    FactorPlace from;
  };
  std::vector<TakenOut> taken_out_;  ///< Removed since the last commit.
  Contributions contributions_;
  double total_flops_ = 0.0;
  double saved_total_flops_ = 0.0;
  std::size_t undo_bytes_;
  std::size_t undo_bytes_left_ = 0;  ///< Remaining until the next commit.
  bool keeps_all_ = false;
  std::vector<int> lost_;
};

}  // namespace understory::factor_graph::bayes_tree
