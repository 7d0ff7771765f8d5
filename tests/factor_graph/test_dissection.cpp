// Orders for large fields: a dissection is an order, always the same one, and the plan takes it
// where it saves work.
#include <algorithm>
#include <numeric>
#include <set>
#include <thread>

#include "common/factor_graph/bayes_tree/clique_plan.hpp"
#include "common/factor_graph/bayes_tree/dissection.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

constexpr int kDimension = 2;

/// A forest seen patch by patch: the trunks of a rows x columns field, each patch of 5 x 5 tied
/// together.
struct Field {
  std::vector<int> starts;
  std::vector<int> entries;
  int size = 0;

  Field(int rows, int columns) : size(rows * columns) {
    for (int r = 0; r + 4 < rows; ++r) {
      for (int c = 0; c + 4 < columns; ++c) {
        starts.push_back(static_cast<int>(entries.size()));
        for (int k = 0; k < 25; ++k) entries.push_back((r + k / 5) * columns + c + k % 5);
      }
    }
  }
  factor_graph::bayes_tree::ElementLists elements() const { return {starts, entries}; }
  std::vector<int> numbers() const {
    std::vector<int> all(static_cast<std::size_t>(size));
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
};

/// Work of eliminating one variable after the other, sets of neighbours and nothing else.
double plain_flops(const Field& field, const std::vector<int>& order) {
  std::vector<std::set<int>> tied(order.size());
  std::vector<int> position(order.size());
  for (std::size_t p = 0; p < order.size(); ++p) {
    position[static_cast<std::size_t>(order[p])] = static_cast<int>(p);
  }
  for (int e = 0; e < field.elements().count(); ++e) {
    for (const int v : field.elements()[e]) {
      for (const int w : field.elements()[e]) {
        const int p = position[static_cast<std::size_t>(v)];
        const int q = position[static_cast<std::size_t>(w)];
        if (q > p) tied[static_cast<std::size_t>(p)].insert(q);
      }
    }
  }
  double sum = 0.0;
  for (auto& later : tied) {
    sum += factor_graph::bayes_tree::elimination_flops(
        kDimension, kDimension * static_cast<double>(later.size()) + 1.0);
    if (later.empty()) continue;
    const int first = *later.begin();
    later.erase(later.begin());
    tied[static_cast<std::size_t>(first)].insert(later.begin(), later.end());
  }
  return sum;
}

double planned_flops(const Field& field, int last) {
  factor_graph::bayes_tree::CliquePlanner planner;
  const std::vector<int> dimensions(static_cast<std::size_t>(field.size), kDimension);
  planner.clear(dimensions);
  for (int e = 0; e < field.elements().count(); ++e) {
    planner.begin_element();
    for (const int v : field.elements()[e]) planner.add_to_element(v);
  }
  planner.set_last(last);
  const factor_graph::bayes_tree::CliquePlan& plan = planner.plan();
  double sum = 0.0;
  for (const factor_graph::bayes_tree::CliquePlan::Clique& clique : plan.cliques) {
    sum += factor_graph::bayes_tree::elimination_flops(
        kDimension * clique.frontal_count,
        kDimension * (clique.row_count - clique.frontal_count) + 1.0);
  }
  CHECK(plan.rows[static_cast<std::size_t>(plan.cliques.back().first_row +
                                           plan.cliques.back().frontal_count - 1)] == last);
  return sum;
}

}  // namespace

TEST_CASE("a dissection names every variable once and divides the field", "[dissection]") {
  const Field field(40, 60);
  std::vector<int> order = dissect(field.elements(), field.numbers(), field.size);
  // Row by row, whose front is as wide as the field is long.
  CHECK(plain_flops(field, order) < 0.8 * plain_flops(field, field.numbers()));
  std::sort(order.begin(), order.end());
  CHECK(order == field.numbers());
}

TEST_CASE("variables without a number are left out of a dissection", "[dissection]") {
  const Field field(10, 30);
  std::vector<int> numbers = field.numbers();
  for (int& number : numbers) number = number < 10 ? -1 : number - 10;
  std::vector<int> order = dissect(field.elements(), numbers, field.size - 10);
  std::sort(order.begin(), order.end());
  std::vector<int> all(static_cast<std::size_t>(field.size - 10));
  std::iota(all.begin(), all.end(), 0);
  CHECK(order == all);
}

TEST_CASE("a dissection is the same one whatever other threads do", "[dissection]") {
  const Field field(30, 40);
  const std::vector<int> alone = dissect(field.elements(), field.numbers(), field.size);
  std::vector<int> same(4, 0);
  {
    std::vector<std::jthread> threads;
    for (int& count : same) {
      threads.emplace_back([&] {
        for (int i = 0; i < 10; ++i) {
          count += dissect(field.elements(), field.numbers(), field.size) == alone ? 1 : 0;
        }
      });
    }
  }
  CHECK(same == std::vector<int>(4, 10));
}

TEST_CASE("the plan of a large field costs no more than its dissection", "[dissection]") {
  const Field field(40, 60);
  const double dissected =
      plain_flops(field, dissect(field.elements(), field.numbers(), field.size));
  // Merged cliques trade a little more work for fewer of them; COLAMD alone needs a fifth more.
  CHECK(planned_flops(field, field.size / 2) < 1.08 * dissected);
}
