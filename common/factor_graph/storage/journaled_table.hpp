// Records by number, with undo.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/factor_graph/storage/block_list.hpp"

namespace understory::factor_graph::storage {

/// A table of plain records. The first change of a record since the last commit() saves its old
/// value: rollback() costs the changes and restores them exactly, including the order of free
/// numbers. Removed numbers are reused after the next commit().
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
  /// Removes a record. Its number is reused after the next commit(); until then the record stays.
  void remove(int id) { removed_.push_back(id); }

  /// The record with this number.
  const T& operator[](int id) const { return records_[static_cast<std::size_t>(id)]; }
  /// The same for a change: the first one since the last commit() saves the old value.
  T& edit(int id) {
    const auto at = static_cast<std::size_t>(id);
    if (saved_at_[at] != epoch_) {
      saved_at_[at] = epoch_;
      saved_ids_.push_back(id);
      saved_.push_back(records_[at]);
    }
    return records_[at];
  }
  /// The same for fields that are no part of the state: rollback() may restore them or not.
  T& edit_unsaved(int id) { return records_[static_cast<std::size_t>(id)]; }

  /// Number of records, with those removed.
  int size() const { return static_cast<int>(records_.size()); }
  /// Grows with every commit: an object with this epoch was made since the last commit.
  std::uint64_t epoch() const { return epoch_; }

  /// Calls `on_removed(record)` for every record that is now finally removed, and `on_saved(before,
  /// now)` for every changed one.
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

  /// Calls `on_undone(id, now, before)` for every changed record and `on_added(id, now)` for every
  /// added one, which is removed.
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

  /// Numbers given out since the last commit().
  const std::vector<int>& added() const { return added_; }

 private:
  void forget() {
    saved_ids_.clear();
    saved_.clear();
    added_.clear();
    removed_.clear();
    ++epoch_;
  }

  BlockList<T> records_;
  BlockList<std::uint64_t> saved_at_;  ///< Epoch of the last save of each record.
  std::vector<int> free_;
  BlockList<int> saved_ids_;  ///< Numbers of records changed since the last commit ...
  BlockList<T> saved_;        ///< ... and their old values.
  std::vector<int> added_;
  std::vector<int> removed_;
  std::uint64_t epoch_ = 1;
};

}  // namespace understory::factor_graph::storage
