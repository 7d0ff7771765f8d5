#include "common/factor_graph/bayes_tree/elimination_problem.hpp"

namespace understory::factor_graph::bayes_tree {

void EliminationProblem::find_neighbours() {
  for (int e = 0; e < element_count(); ++e) {
    const std::span<const int> tied = element(e);
    const bool is_near =
        std::any_of(tied.begin(), tied.end(), [&](int v) { return group(v) == kLast; });
    if (!is_near) continue;
    for (const int v : tied) {
      int& group = group_[static_cast<std::size_t>(v)];
      group = std::max<int>(group, kNeighbours);
    }
  }
}

double EliminationProblem::least_flops() const {
  double largest = 0.0;
  for (int e = 0; e < element_count(); ++e) {
    double rows = 0.0;
    for (const int v : element(e)) rows += dimension(v);
    largest = std::max(largest, rows);
  }
  return elimination_flops(largest, 0.0);
}

}  // namespace understory::factor_graph::bayes_tree
