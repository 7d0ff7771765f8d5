// A set of nodes in one bit for each node there ever was.
#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "services/geoslam_mapper/smoothing/centre_motion.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Nodes by their numbers.
class NodeSet {
 public:
  /// Whether the node is in it.
  bool contains(NodeIndex node) const { return node < is_in_.size() && is_in_[node]; }
  /// Adds it.
  void insert(NodeIndex node) {
    if (contains(node)) return;
    if (is_in_.size() <= node) is_in_.resize(node + 1);
    is_in_[node] = true;
    ++size_;
  }
  /// Takes it out. False where it was not in it.
  bool erase(NodeIndex node) {
    if (!contains(node)) return false;
    is_in_[node] = false;
    --size_;
    return true;
  }
  /// How many there are.
  std::size_t size() const { return size_; }
  /// All of them, ascending. O(largest number).
  std::set<NodeIndex> all() const {
    std::set<NodeIndex> nodes;
    for (std::size_t i = 0; i < is_in_.size(); ++i)
      if (is_in_[i]) nodes.insert(nodes.end(), static_cast<NodeIndex>(i));
    return nodes;
  }

 private:
  std::vector<bool> is_in_;
  std::size_t size_ = 0;
};

}  // namespace understory::geoslam_mapper::smoothing
