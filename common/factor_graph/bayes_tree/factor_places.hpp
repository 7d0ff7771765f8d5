// Which clique assembles each factor.
#pragma once

#include <cstdint>

#include "common/factor_graph/graph/factor_graph.hpp"
#include "common/factor_graph/storage/block_list.hpp"

namespace understory::factor_graph::bayes_tree {

/// Where a factor is: its clique, and the index in that clique's list.
struct FactorPlace {
  int clique = graph::kNone;
  int at = 0;

  friend bool operator==(const FactorPlace&, const FactorPlace&) = default;
};

/// The places of all factors, with undo. Beside their records and not in them: an update changes
/// the places of thousands, and a place is a sixteenth of a record (docs/decisions/152). No
/// JournaledTable: that one gives out numbers, and clears what it gives out again.
class FactorPlaces {
 public:
  /// Place of a factor; of one that no clique has ever held, none.
  FactorPlace operator[](int factor) const {
    return is_known(factor) ? places_[static_cast<std::size_t>(factor)] : FactorPlace{};
  }
  /// Puts a factor elsewhere.
  void put(int factor, const FactorPlace& place) {
    while (!is_known(factor)) {
      places_.push_back({});
      saved_at_.push_back(0);
    }
    const auto at = static_cast<std::size_t>(factor);
    if (saved_at_[at] != epoch_) {
      saved_at_[at] = epoch_;
      saved_.push_back({factor, places_[at]});
    }
    places_[at] = place;
  }

  /// Makes all changes final.
  void commit() {
    saved_.clear();
    ++epoch_;
  }
  /// Restores the places of the last commit(); costs what changed.
  void rollback() {
    for (std::size_t i = 0; i < saved_.size(); ++i)
      places_[static_cast<std::size_t>(saved_[i].factor)] = saved_[i].place;
    commit();
  }

 private:
  struct Saved {
    int factor;
    FactorPlace place;
  };
  bool is_known(int factor) const { return static_cast<std::size_t>(factor) < places_.size(); }

  storage::BlockList<FactorPlace> places_;      ///< By factor.
  storage::BlockList<std::uint64_t> saved_at_;  ///< Epoch in which each was saved last.
  storage::BlockList<Saved> saved_;             ///< What was changed since the last commit.
  std::uint64_t epoch_ = 1;
};

}  // namespace understory::factor_graph::bayes_tree
