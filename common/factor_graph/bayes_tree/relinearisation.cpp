#include "common/factor_graph/bayes_tree/relinearisation.hpp"

#include <algorithm>
#include <cmath>

namespace understory::factor_graph::bayes_tree {
namespace {

/// Residuals of more rows than these are as large as those of so many.
constexpr int kMostRows = 6;
constexpr double kPlanarRows = 3.0;

}  // namespace

double limit_scale(const graph::FactorRecord& factor) {
  return std::sqrt(std::clamp<double>(factor.rows, kPlanarRows, kMostRows) / kPlanarRows);
}

std::vector<int> stale_factors(const graph::FactorGraph& graph, const CliqueTree& cliques,
                               double limit) {
  std::vector<int> stale;
  std::vector<int> stack{CliqueTree::kRoot};
  while (!stack.empty()) {
    const CliqueRecord& clique = cliques[stack.back()];
    stack.pop_back();

    for (int f = clique.first_factor; f != graph::kNone; f = graph.factor(f).next) {
      const graph::FactorRecord& factor = graph.factor(f);
      if (factor.is_pending) continue;
      if (graph.deviation(f).residual > limit * limit_scale(factor)) stale.push_back(f);
    }
    for (int c = clique.first_child; c != graph::kNone; c = cliques[c].next_sibling) {
      stack.push_back(c);
    }
  }
  return stale;
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

void Relinearisation::begin_sweep(std::vector<int> factors, int parts) {
  now_.sweep = std::move(factors);
  now_.sweep_part = 1 + static_cast<int>(now_.sweep.size()) / parts;
}

void Relinearisation::take_part_of_sweep() {
  for (int i = 0; i < now_.sweep_part && !now_.sweep.empty(); ++i) {
    const int f = now_.sweep.back();
    now_.sweep.pop_back();
    // It may have been removed, and its number given to another, since.
    if (f >= graph_.factor_capacity()) continue;
    if (graph_.factor(f).in_use && graph_.factor(f).clique != graph::kNone) add(f);
  }
}

}  // namespace understory::factor_graph::bayes_tree
