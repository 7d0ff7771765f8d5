#include "common/place_recognition/verifiers/max_clique.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace understory::place_recognition::verifiers {

bool VertexSet::empty() const {
  return std::all_of(words_.begin(), words_.end(), [](std::uint64_t word) { return word == 0; });
}

std::size_t VertexSet::count() const {
  std::size_t count = 0;
  for (const std::uint64_t word : words_) count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

void VertexSet::intersect(const VertexSet& other) {
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= other.words_[i];
}

void VertexSet::subtract(const VertexSet& other) {
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= ~other.words_[i];
}

std::size_t VertexSet::first() const {
  std::size_t i = 0;
  while (words_[i] == 0) ++i;
  return 64 * i + static_cast<std::size_t>(std::countr_zero(words_[i]));
}

VertexGraph::VertexGraph(std::size_t vertices) : neighbours_(vertices, VertexSet(vertices)) {}

namespace {

/// The search over a graph with vertices in order of decreasing degree, which needs few colours.
class CliqueSearch {
 public:
  CliqueSearch(const VertexGraph& graph, std::size_t most_branches)
      : graph_(graph), branches_left_(most_branches) {}

  Clique run() {
    VertexSet all(graph_.size());
    for (std::size_t v = 0; v < graph_.size(); ++v) all.insert(v);
    expand(std::move(all));
    return {best_, !is_stopped_};
  }

 private:
  struct Coloured {
    std::uint32_t vertex = 0;
    /// A clique among this vertex and those before has at most this size.
    std::uint32_t colour = 0;
  };

  /// Vertices by colour; no two of one colour are neighbours.
  std::vector<Coloured> coloured(VertexSet left) const {
    std::vector<Coloured> order;
    for (std::uint32_t colour = 1; !left.empty(); ++colour) {
      VertexSet free = left;
      while (!free.empty()) {
        const std::size_t vertex = free.first();
        free.erase(vertex);
        left.erase(vertex);
        free.subtract(graph_.neighbours(vertex));
        order.push_back({static_cast<std::uint32_t>(vertex), colour});
      }
    }
    return order;
  }

  void expand(VertexSet candidates) {
    const std::vector<Coloured> order = coloured(candidates);
    for (auto next = order.rbegin(); next != order.rend(); ++next) {
      if (chosen_.size() + next->colour <= best_.size()) return;
      if (branches_left_ == 0) {
        is_stopped_ = true;
        return;
      }
      --branches_left_;

      chosen_.push_back(next->vertex);
      VertexSet common = candidates;
      common.intersect(graph_.neighbours(next->vertex));
      if (common.empty()) {
        if (chosen_.size() > best_.size()) best_ = chosen_;
      } else {
        expand(std::move(common));
      }
      chosen_.pop_back();
      candidates.erase(next->vertex);
    }
  }

  const VertexGraph& graph_;
  std::size_t branches_left_;
  bool is_stopped_ = false;
  std::vector<std::uint32_t> chosen_;
  std::vector<std::uint32_t> best_;
};

}  // namespace

Clique max_clique(const VertexGraph& graph, std::size_t most_branches) {
  std::vector<std::size_t> degree(graph.size());
  for (std::size_t v = 0; v < graph.size(); ++v) degree[v] = graph.neighbours(v).count();
  std::vector<std::uint32_t> order(graph.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return degree[a] > degree[b]; });

  // A vertex without neighbours cannot be in a clique of two.
  while (order.size() > 1 && degree[order.back()] == 0) order.pop_back();
  VertexGraph sorted(order.size());
  for (std::size_t a = 0; a < order.size(); ++a) {
    for (std::size_t b = a + 1; b < order.size(); ++b) {
      if (graph.connected(order[a], order[b])) sorted.connect(a, b);
    }
  }

  Clique found = CliqueSearch(sorted, std::max<std::size_t>(most_branches, 1)).run();
  for (std::uint32_t& vertex : found.vertices) vertex = order[vertex];
  std::sort(found.vertices.begin(), found.vertices.end());
  return found;
}

}  // namespace understory::place_recognition::verifiers
