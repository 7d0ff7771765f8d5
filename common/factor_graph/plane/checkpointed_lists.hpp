// Lists of the smoother beside its graph; each can return to the checkpoint.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "common/factor_graph/plane/smoother.hpp"
#include "common/factor_graph/storage/steady_growth.hpp"

namespace understory::factor_graph::plane {

/// Marks a measurement without a factor in the graph.
inline constexpr graph::FactorId kNoFactor{graph::kNone};

/// A list that only grows, with its length at the checkpoint.
template <typename T>
class AppendList {
 public:
  /// Appends an entry.
  void push_back(const T& item) { items_.push_back(item); }
  /// Number of entries.
  std::size_t size() const { return items_.size(); }
  /// Entry with this index.
  const T& operator[](std::size_t at) const { return items_[at]; }
  /// All entries in their order.
  const std::vector<T>& items() const { return items_; }
  /// Sets the checkpoint.
  void commit() { saved_size_ = items_.size(); }
  /// Returns to the checkpoint.
  void rollback() { items_.resize(saved_size_); }

 private:
  std::vector<T> items_;
  std::size_t saved_size_ = 0;
};

/// Poses: each is a variable of the graph, or a parked pose with its last estimate.
class PoseList {
 public:
  /// One pose.
  struct Entry {
    graph::VariableId name{graph::kNone};  ///< None while it is parked.
    geometry::SE2 parked;
  };
  /// Appends a variable.
  void push_back(graph::VariableId name) { entries_.push_back({name, {}}); }
  /// Replaces an entry; rollback() restores it.
  void replace(std::size_t at, const Entry& entry) {
    changes_.emplace_back(at, entries_[at]);
    entries_[at] = entry;
  }
  /// Number of entries.
  std::size_t size() const { return entries_.size(); }
  /// Entry with this index.
  const Entry& operator[](std::size_t at) const { return entries_[at]; }
  /// Whether the pose is parked, so that it is no variable.
  bool is_parked(PoseId id) const {
    return entries_[index(id)].name == graph::VariableId{graph::kNone};
  }
  /// Sets the checkpoint.
  void commit() {
    changes_.clear();
    saved_size_ = entries_.size();
  }
  /// Returns to the checkpoint.
  void rollback() {
    for (; !changes_.empty(); changes_.pop_back())
      entries_[changes_.back().first] = changes_.back().second;
    entries_.resize(saved_size_);
  }

 private:
  std::deque<Entry> entries_;  ///< In blocks, because there are many parked poses.
  std::vector<std::pair<std::size_t, Entry>> changes_;  ///< Changes since the checkpoint.
  std::size_t saved_size_ = 0;
};

/// Measurements, which can be replaced.
template <typename Measured>
class FactorList {
 public:
  /// One measurement.
  struct Entry {
    Measured measured;
    graph::FactorId factor = kNoFactor;  ///< None where the information is zero.
  };
  /// Appends a measurement.
  void push_back(const Entry& entry) {
    storage::make_room(entries_);
    entries_.push_back(entry);
  }
  /// Replaces a measurement; rollback() restores it.
  void replace(std::size_t at, const Entry& entry) {
    storage::make_room(changes_);
    changes_.push_back({at, entries_[at]});
    entries_[at] = entry;
  }
  /// Number of entries.
  std::size_t size() const { return entries_.size(); }
  /// Entry with this index.
  const Entry& operator[](std::size_t at) const { return entries_[at]; }
  /// All measurements in their order.
  std::vector<Measured> measured() const {
    std::vector<Measured> all;
    all.reserve(entries_.size());
    for (const Entry& one : entries_) all.push_back(one.measured);
    return all;
  }
  /// Sets the checkpoint.
  void commit() {
    changes_.clear();
    saved_size_ = entries_.size();
  }
  /// Returns to the checkpoint.
  void rollback() {
    for (std::size_t i = changes_.size(); i-- > 0;) entries_[changes_[i].at] = changes_[i].before;
    changes_.clear();
    entries_.resize(saved_size_);
  }

 private:
  struct Change {
    std::size_t at = 0;
    Entry before;
  };
  std::vector<Entry> entries_;
  std::vector<Change> changes_;  ///< Changes since the checkpoint.
  std::size_t saved_size_ = 0;
};

/// Poses and points that updates moved since the checkpoint, each once.
class MovedList {
 public:
  /// Registers the variable as the pose or the point with this index.
  void give_role(graph::VariableId name, std::size_t role) {
    const auto at = static_cast<std::size_t>(index(name));
    if (roles_.size() <= at) roles_.resize(at + 1);
    roles_[at] = {static_cast<std::uint32_t>(role), false};
  }
  /// Adds the variables that the last update moved.
  void collect(const bayes_tree::IncrementalSmoother& smoother) {
    for (const int v : smoother.moved()) {
      const graph::VariableType type = smoother.graph().type(graph::VariableId(v));
      if (type == graph::VariableType::kScalar) continue;
      Role& role = roles_[static_cast<std::size_t>(v)];
      if (role.is_moved) continue;

      role.is_moved = true;
      moved_.push_back(v);
      if (type == graph::VariableType::kPose2) {
        poses_.push_back(PoseId(role.index));
      } else {
        points_.push_back(PointId(role.index));
      }
    }
  }
  /// Clears the list.
  void clear() {
    for (const int v : moved_) roles_[static_cast<std::size_t>(v)].is_moved = false;
    moved_.clear();
    poses_.clear();
    points_.clear();
  }
  /// Poses that moved.
  const std::vector<PoseId>& poses() const { return poses_; }
  /// Points that moved.
  const std::vector<PointId>& points() const { return points_; }

 private:
  struct Role {
    std::uint32_t index = 0;  ///< Index among the poses, or among the points.
    bool is_moved = false;
  };
  std::vector<Role> roles_;  ///< Per variable; unused for scalars.
  std::vector<int> moved_;   ///< Variables.
  std::vector<PoseId> poses_;
  std::vector<PointId> points_;
};

}  // namespace understory::factor_graph::plane
