// The largest clique against all subsets.
#include "common/place_recognition/verifiers/max_clique.hpp"

#include <algorithm>
#include <bit>
#include <random>

#include "tests/catch.hpp"

using namespace understory::place_recognition::verifiers;

namespace {

VertexGraph random_graph(std::mt19937_64& random, std::size_t vertices, double density) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  VertexGraph graph(vertices);
  for (std::size_t a = 0; a < vertices; ++a) {
    for (std::size_t b = a + 1; b < vertices; ++b) {
      if (unit(random) < density) graph.connect(a, b);
    }
  }
  return graph;
}

std::size_t slow_clique(const VertexGraph& graph) {
  std::size_t best = 0;
  for (std::uint32_t set = 0; set < (1U << graph.size()); ++set) {
    bool is_clique = true;
    for (std::size_t a = 0; a < graph.size() && is_clique; ++a) {
      for (std::size_t b = a + 1; b < graph.size() && is_clique; ++b) {
        const bool has_both = ((set >> a) & 1) != 0 && ((set >> b) & 1) != 0;
        is_clique = !has_both || graph.connected(a, b);
      }
    }
    if (is_clique) best = std::max(best, static_cast<std::size_t>(std::popcount(set)));
  }
  return best;
}

bool is_clique(const VertexGraph& graph, const std::vector<std::uint32_t>& vertices) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (std::size_t j = i + 1; j < vertices.size(); ++j) {
      if (!graph.connected(vertices[i], vertices[j])) return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("The largest clique is as large as the best of all subsets", "[clique]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  for (int trial = 0; trial < 150; ++trial) {
    const VertexGraph graph = random_graph(random, 1 + random() % 13, unit(random));
    const Clique found = max_clique(graph, 100000);
    CHECK(found.is_largest);
    CHECK(is_clique(graph, found.vertices));
    CHECK(found.vertices.size() == slow_clique(graph));
    CHECK(std::is_sorted(found.vertices.begin(), found.vertices.end()));
  }
}

TEST_CASE("A planted clique in a large sparse graph is found", "[clique]") {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 5; ++trial) {
    VertexGraph graph = random_graph(random, 400, 0.05);
    std::vector<std::uint32_t> planted(400);
    for (std::uint32_t i = 0; i < 400; ++i) planted[i] = i;
    std::shuffle(planted.begin(), planted.end(), random);
    planted.resize(14);
    for (const std::uint32_t a : planted) {
      for (const std::uint32_t b : planted) {
        if (a != b) graph.connect(a, b);
      }
    }
    std::sort(planted.begin(), planted.end());
    const Clique found = max_clique(graph, 200000);
    CHECK(found.is_largest);
    CHECK(found.vertices == planted);
  }
}

TEST_CASE("With few branches a clique is given that need not be the largest", "[clique]") {
  std::mt19937_64 random(3);
  const VertexGraph graph = random_graph(random, 120, 0.7);
  const Clique whole = max_clique(graph, 50'000'000);
  REQUIRE(whole.is_largest);
  std::size_t last = 0;
  for (const std::size_t branches : {1U, 30U, 300U, 3000U, 30000U}) {
    const Clique found = max_clique(graph, branches);
    CHECK(is_clique(graph, found.vertices));
    CHECK(found.vertices.size() >= last);
    CHECK(found.vertices.size() <= whole.vertices.size());
    if (branches <= 300U) CHECK_FALSE(found.is_largest);
    last = found.vertices.size();
  }
  CHECK(last > 5);
}

TEST_CASE("Graphs without vertices and without edges", "[clique]") {
  CHECK(max_clique(VertexGraph(0), 10).vertices.empty());
  CHECK(max_clique(VertexGraph(5), 10).vertices.size() == 1);
}
