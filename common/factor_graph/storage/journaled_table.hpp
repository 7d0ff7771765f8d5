// Records by number, with undo.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/factor_graph/storage/block_list.hpp"

namespace understory::factor_graph::storage {

/// A table of plain records. A record's first change since the last commit() keeps what it was:
/// rollback() costs what changed and restores it exactly, with the order in which numbers are given
/// out. Numbers given back serve again after the next commit().
template <typename T>
class JournaledTable {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// A new record, of T{}; returns its number.
  int add() {
    int id = 0;
    if (free_.empty()) {
      id = size();
      records_.push_back(T{});
      saved_at_.push_back(0);
    } else {
      id = free_.back();
      free_.pop_back();
      records_[static_cast<std::size_t>(id)] = T{};
    }
    saved_at_[static_cast<std::size_t>(id)] = epoch_;
    added_.push_back(id);
    return id;
  }
  /// Its number serves again after the next commit(); until then the record stays.
  void remove(int id) { removed_.push_back(id); }

  /// The record with this number.
  const T& operator[](int id) const { return records_[static_cast<std::size_t>(id)]; }
  /// The same for change: its first change since the last commit() saves what it was.
  T& edit(int id) {
    const auto at = static_cast<std::size_t>(id);
    if (saved_at_[at] != epoch_) {
      saved_at_[at] = epoch_;
      saved_ids_.push_back(id);
      saved_.push_back(records_[at]);
    }
    return records_[at];
  }
  /// The same for what is no part of the state: rollback() may restore it or not.
  T& edit_unsaved(int id) { return records_[static_cast<std::size_t>(id)]; }

  /// Number of records, with those removed.
  int size() const { return static_cast<int>(records_.size()); }
  /// Grows with every commit: what carries it was made since the last one.
  std::uint64_t epoch() const { return epoch_; }

  /// `on_removed(record)` for every record that is now gone for good; `on_saved(before, now)` for
  /// every one that was changed.
  template <typename OnRemoved, typename OnSaved>
  void commit(OnRemoved&& on_removed, OnSaved&& on_saved) {
    for (std::size_t i = 0; i < saved_.size(); ++i)
      on_saved(std::as_const(saved_)[i], (*this)[saved_ids_[i]]);
    for (const int id : removed_) {
      on_removed((*this)[id]);
      free_.push_back(id);
    }
    forget();
  }

  /// `on_undone(id, now, before)` for every changed record, `on_added(id, now)` for every one that
  /// ceases to be.
  template <typename OnUndone, typename OnAdded>
  void rollback(OnUndone&& on_undone, OnAdded&& on_added) {
    for (std::size_t i = 0; i < saved_.size(); ++i) {
      T& record = records_[static_cast<std::size_t>(saved_ids_[i])];
      on_undone(saved_ids_[i], record, saved_[i]);
      record = saved_[i];
    }
    for (std::size_t i = added_.size(); i-- > 0;) {
      T& record = records_[static_cast<std::size_t>(added_[i])];
      on_added(added_[i], record);
      record = T{};
      free_.push_back(added_[i]);
    }
    while (!free_.empty() && free_.back() == size() - 1) {
      free_.pop_back();
      records_.pop_back();
      saved_at_.pop_back();
    }
    forget();
  }

 private:
  void forget() {
    saved_ids_.clear();
    saved_.clear();
    added_.clear();
    removed_.clear();
    ++epoch_;
  }

  BlockList<T> records_;
  BlockList<std::uint64_t> saved_at_;  ///< Epoch in which each was saved last.
  std::vector<int> free_;
  BlockList<int> saved_ids_;  ///< Of those changed since the last commit ...
  BlockList<T> saved_;        ///< ... what they were.
  std::vector<int> added_;
  std::vector<int> removed_;
  std::uint64_t epoch_ = 1;
};

}  // namespace understory::factor_graph::storage
