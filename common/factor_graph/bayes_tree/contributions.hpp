// Contributions of cliques to their parents.
#pragma once

#include <cstddef>
#include <vector>

#include "common/factor_graph/storage/block_pool.hpp"

namespace understory::factor_graph::bayes_tree {

/// Owns the contributions of cliques, by number: Schur complements on their separators, lower
/// triangles column by column. Whether one is stored is no part of the tree's state, because it can
/// be computed again.
class Contributions {
 public:
  /// Contribution of the clique; null = not stored.
  const double* find(int clique) const {
    const auto at = static_cast<std::size_t>(clique);
    return at < blocks_.size() ? blocks_[at].numbers : nullptr;
  }
  /// Memory for the clique's contribution of `count` numbers; it replaces a stored one.
  double* make(int clique, std::size_t count) {
    const auto at = static_cast<std::size_t>(clique);
    if (at >= blocks_.size()) blocks_.resize(at + 1);
    Block& block = blocks_[at];
    if (block.count != count) {
      drop(clique);
      block = {pool_.take(count), count};
    }
    return block.numbers;
  }
  /// Drops the clique's contribution, if stored.
  void drop(int clique) {
    if (find(clique) == nullptr) return;
    Block& block = blocks_[static_cast<std::size_t>(clique)];
    pool_.give_back(block.numbers, block.count);
    block = {};
  }

  /// Memory taken from the system [bytes].
  std::size_t bytes() const { return pool_.bytes(); }

 private:
  struct Block {
    double* numbers = nullptr;
    std::size_t count = 0;
  };

  std::vector<Block> blocks_;
  storage::BlockPool<double> pool_;
};

}  // namespace understory::factor_graph::bayes_tree
