// The clique that assembles each factor.
#pragma once

#include <cstdint>

#include "common/factor_graph/graph/factor_graph.hpp"
#include "common/factor_graph/storage/block_list.hpp"

namespace understory::factor_graph::bayes_tree {

/// Place of a factor: its clique, and the index in that clique's list.
struct FactorPlace {
  int clique = graph::kNone;
  int at = 0;

  friend bool operator==(const FactorPlace&, const FactorPlace&) = default;
};

/// The places of all factors, with undo. Not in the factors' records, because an update changes
/// thousands of places, and a place has a sixteenth of the size of a record (docs/decisions/152).
/// Not a JournaledTable, which assigns numbers and clears reused ones.
class FactorPlaces {
 public:
  /// Place of a factor; none if it never had a clique.
  FactorPlace operator[](int factor) const {
    return is_known(factor) ? places_[static_cast<std::size_t>(factor)] : FactorPlace{};
  }
  /// Sets the place of a factor.
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
  /// Restores the places of the last commit(); at the cost of the changes.
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
  storage::BlockList<std::uint64_t> saved_at_;  ///< Epoch of each place's last save.
  storage::BlockList<Saved> saved_;             ///< Changes since the last commit.
  std::uint64_t epoch_ = 1;
};

}  // namespace understory::factor_graph::bayes_tree
