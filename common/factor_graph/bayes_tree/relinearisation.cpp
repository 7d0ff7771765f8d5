#include "common/factor_graph/bayes_tree/relinearisation.hpp"

#include <algorithm>
#include <cmath>

namespace understory::factor_graph::bayes_tree {
namespace {

/// Residuals with more rows count as if they had this many.
constexpr int kMostRows = 6;
constexpr double kPlanarRows = 3.0;

}  // namespace

double limit_scale(const graph::FactorRecord& factor) {
  return std::sqrt(std::clamp<double>(factor.rows, kPlanarRows, kMostRows) / kPlanarRows);
}

std::vector<int> factors_of_tree(const CliqueTree& cliques) {
  std::vector<int> factors;
  std::vector<int> stack{CliqueTree::kRoot};
  while (!stack.empty()) {
    const CliqueRecord& clique = cliques[stack.back()];
    stack.pop_back();

    for (const int f : clique.assembled())
      if (f != graph::kNone) factors.push_back(f);
    for (int c = clique.first_child; c != graph::kNone; c = cliques[c].next_sibling) {
      stack.push_back(c);
    }
  }
  return factors;
}

void Relinearisation::add(int factor) {
  graph::FactorRecord& record = graph_.edit_factor(factor);
  if (record.is_pending) return;
  record.is_pending = true;
  now_.stale.push_back(factor);
}

void Relinearisation::forget_factor(int factor) {
  if (graph_.factor(factor).is_pending) std::erase(now_.stale, factor);
}

long Relinearisation::run() {
  for (const int v : now_.rebase) {
    graph_.rebase(v);
    for (int i = graph_.variable(v).first_incidence; i != graph::kNone;
         i = graph_.incidence(i).next) {
      add(graph_.incidence(i).factor);
    }
  }
  now_.rebase.clear();

  for (const int f : now_.stale) {
    graph_.edit_factor(f).is_pending = false;
    graph_.linearise(f);
    tree_.mark_numbers(f);
  }
  const auto count = static_cast<long>(now_.stale.size());
  now_.stale.clear();
  return count;
}

}  // namespace understory::factor_graph::bayes_tree
