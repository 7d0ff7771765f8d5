// The order of few variables against one found step by step with sets.
#include "common/factor_graph/bayes_tree/minimum_degree.hpp"

#include <algorithm>
#include <random>
#include <set>

#include "tests/catch.hpp"

using namespace understory::factor_graph::bayes_tree;

namespace {

/// Random variables of 1 to 6 degrees of freedom, tied by elements of one to six of them.
EliminationProblem random_problem(std::mt19937_64& random, int variables) {
  EliminationProblem problem;
  std::vector<int> dimensions;
  for (int v = 0; v < variables; ++v) dimensions.push_back(1 + static_cast<int>(random() % 6));
  problem.clear(dimensions);
  const auto any = [&] { return static_cast<int>(random() % static_cast<unsigned>(variables)); };
  for (int e = 0; e < 2 * variables; ++e) {
    problem.begin_element();
    std::set<int> tied{any()};
    const std::size_t more = e % 8 == 0 ? 5 : random() % 2;
    for (std::size_t i = 0; i < more; ++i) tied.insert(any());
    for (const int v : tied) problem.add_to_element(v);
  }
  for (int i = 0; i < variables / 10; ++i) problem.set_last(any());
  problem.find_neighbours();
  return problem;
}

/// Who is tied to whom.
std::vector<std::set<int>> ties_of(const EliminationProblem& problem) {
  std::vector<std::set<int>> ties(static_cast<std::size_t>(problem.size()));
  for (int e = 0; e < problem.element_count(); ++e)
    for (const int v : problem.element(e))
      for (const int w : problem.element(e))
        if (v != w) ties[static_cast<std::size_t>(v)].insert(w);
  return ties;
}

}  // namespace

TEST_CASE("Each variable is of the earliest group and has the least degree when it goes",
          "[minimum_degree]") {
  std::mt19937_64 random(31);
  MinimumDegree minimum_degree;
  for (const int variables : {1, 2, 5, 63, 64, 65, 130, 300}) {
    for (int round = 0; round < 5; ++round) {
      INFO(variables << " variables, round " << round);
      const EliminationProblem problem = random_problem(random, variables);
      std::vector<int> order;
      minimum_degree.order(problem, order);
      std::vector<int> sorted = order;
      std::ranges::sort(sorted);
      REQUIRE(sorted.size() == static_cast<std::size_t>(variables));
      for (int v = 0; v < variables; ++v) REQUIRE(sorted[static_cast<std::size_t>(v)] == v);

      auto ties = ties_of(problem);
      const auto degree = [&](int v) {
        int sum = 0;
        for (const int w : ties[static_cast<std::size_t>(v)]) sum += problem.dimension(w);
        return sum;
      };
      std::set<int> left(order.begin(), order.end());
      bool is_least = true;
      bool is_dense = false;  // From there on any order is the same.
      for (const int v : order) {
        for (const int w : left) {
          is_least = is_least && problem.group(v) <= problem.group(w);
          if (!is_dense && problem.group(v) == problem.group(w))
            is_least = is_least && degree(v) <= degree(w);
        }
        left.erase(v);
        is_dense = is_dense || (problem.group(v) == EliminationProblem::kLast &&
                                ties[static_cast<std::size_t>(v)].size() == left.size());
        const std::set<int> tied = ties[static_cast<std::size_t>(v)];
        for (const int w : tied) {
          auto& theirs = ties[static_cast<std::size_t>(w)];
          theirs.insert(tied.begin(), tied.end());
          theirs.erase(w);
          theirs.erase(v);
        }
      }
      CHECK(is_least);
    }
  }
}
