// A set of nodes, one bit per node number ever used.
#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "services/geoslam_mapper/smoothing/centre_motion.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Nodes by their numbers.
class NodeSet {
 public:
  /// Whether the set has the node.
  bool contains(NodeIndex node) const { return node < is_in_.size() && is_in_[node]; }
  /// Adds a node.
  void insert(NodeIndex node) {
    if (contains(node)) return;
    if (is_in_.size() <= node) is_in_.resize(node + 1);
    is_in_[node] = true;
    ++size_;
  }
  /// Removes a node. False if it was not in the set.
  bool erase(NodeIndex node) {
    if (!contains(node)) return false;
    is_in_[node] = false;
    --size_;
    return true;
  }
  /// Number of nodes.
  std::size_t size() const { return size_; }
  /// All nodes, ascending. O(largest number).
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
