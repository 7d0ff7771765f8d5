// The largest set of vertices of a graph that are all neighbours of each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::place_recognition::verifiers {

/// A set of vertices, a bit for each.
class VertexSet {
 public:
  /// Empty, for `size` vertices.
  explicit VertexSet(std::size_t size) : words_((size + 63) / 64, 0) {}

  /// Adds a vertex.
  void insert(std::size_t vertex) { words_[vertex / 64] |= std::uint64_t{1} << (vertex % 64); }
  /// Removes a vertex.
  void erase(std::size_t vertex) { words_[vertex / 64] &= ~(std::uint64_t{1} << (vertex % 64)); }
  /// Whether the set contains a vertex.
  bool contains(std::size_t vertex) const {
    return ((words_[vertex / 64] >> (vertex % 64)) & 1) != 0;
  }
  /// Whether the set is empty.
  bool empty() const;
  /// Number of vertices.
  std::size_t count() const;
  /// Intersects with `other`.
  void intersect(const VertexSet& other);
  /// Removes the vertices of `other`.
  void subtract(const VertexSet& other);
  /// The smallest vertex. Precondition: not empty.
  std::size_t first() const;

 private:
  std::vector<std::uint64_t> words_;
};

/// An undirected graph without loops.
class VertexGraph {
 public:
  /// Without edges.
  explicit VertexGraph(std::size_t vertices);

  /// Adds an edge. Precondition: a != b.
  void connect(std::size_t a, std::size_t b) {
    neighbours_[a].insert(b);
    neighbours_[b].insert(a);
  }
  /// Whether there is an edge.
  bool connected(std::size_t a, std::size_t b) const { return neighbours_[a].contains(b); }
  /// Number of vertices.
  std::size_t size() const { return neighbours_.size(); }
  /// Neighbours of a vertex.
  const VertexSet& neighbours(std::size_t vertex) const { return neighbours_[vertex]; }

 private:
  std::vector<VertexSet> neighbours_;
};

/// Result of the search.
struct Clique {
  std::vector<std::uint32_t> vertices;  ///< Ascending.
  bool is_largest = false;              ///< False if the search ended before the proof.
};

/// Branch and bound with greedy colouring (Tomita & Seki 2003; bit sets as San Segundo et al.
/// 2011). After `most_branches` branches the largest clique so far is returned: at least that of
/// the first greedy descent. Exponential in the worst case, hence the limit.
Clique max_clique(const VertexGraph& graph, std::size_t most_branches);

}  // namespace understory::place_recognition::verifiers
