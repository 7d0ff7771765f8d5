#include "common/factor_graph/bayes_tree/back_substitution.hpp"

#include <algorithm>
#include <cmath>

namespace understory::factor_graph::bayes_tree {
namespace {

std::span<const int> rows_of(const CliqueRecord& clique) {
  return {clique.rows, static_cast<std::size_t>(clique.row_count)};
}

std::span<const int> separator_of(const CliqueRecord& clique) {
  return rows_of(clique).subspan(static_cast<std::size_t>(clique.frontal_count));
}

/// Largest component of L' (to - from) of the variable whose first row is `first`.
double whitened_distance(const CliqueRecord& clique, int first, int size, const double* to,
                         const graph::Delta& from) {
  double largest = 0.0;
  for (int c = 0; c < size; ++c) {
    const double* column = clique.panel + static_cast<std::ptrdiff_t>(first + c) * clique.size;
    double whitened = 0.0;
    for (int r = c; r < size; ++r) {
      whitened += column[first + r] * (to[r] - from[static_cast<std::size_t>(r)]);
    }
    largest = std::max(largest, std::abs(whitened));
  }
  return largest;
}

}  // namespace

void BackSubstitution::move_variables(const CliqueRecord& clique, double threshold) {
  int first = 0;
  for (int i = 0; i < clique.frontal_count; ++i) {
    const int name = clique.rows[i];
    const graph::VariableRecord& variable = graph_.variable(name);
    const int size = dimension(variable.type);
    const double* to = step_.data() + first;
    const double distance = whitened_distance(clique, first, size, to, variable.delta);
    if (distance > threshold) {
      moves_.note(name, variable.delta, distance);
      graph_.move(name, to);
    }
    first += size;
  }
}

void BackSubstitution::solve_clique(int id, double threshold) {
  const CliqueRecord& clique = cliques_[id];
  step_.resize(static_cast<std::size_t>(clique.size));

  int row = clique.pivots;
  for (const int name : separator_of(clique)) {
    const graph::VariableRecord& variable = graph_.variable(name);
    const int size = dimension(variable.type);
    std::copy_n(variable.delta.begin(), size, step_.begin() + row);
    row += size;
  }

  kernel_.back_substitute(clique.panel, clique.size, clique.pivots, step_.data());
  move_variables(clique, threshold);
}

/// Pushes the children with a moved separator.
void BackSubstitution::push_children(int id, bool is_whole) {
  if (!is_whole && moves_.largest(rows_of(cliques_[id])) == 0.0) return;

  for (int c = cliques_[id].first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    if (is_computed_[static_cast<std::size_t>(c)] != 0) continue;
    if (is_whole || moves_.largest(separator_of(cliques_[c])) > 0.0) stack_.push_back(c);
  }
}

void BackSubstitution::solve_from(int id, double threshold, bool is_whole) {
  stack_.assign(1, id);
  while (!stack_.empty()) {
    const int c = stack_.back();
    stack_.pop_back();
    solve_clique(c, threshold);
    push_children(c, is_whole);
  }
}

void BackSubstitution::solve(std::span<const int> computed, double threshold, bool is_whole) {
  moves_.begin(graph_.variable_capacity());
  is_computed_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);

  for (const int c : computed) is_computed_[static_cast<std::size_t>(c)] = 1;
  for (std::size_t i = computed.size(); i-- > 0;) solve_from(computed[i], threshold, is_whole);
  for (const int c : computed) is_computed_[static_cast<std::size_t>(c)] = 0;
}

}  // namespace understory::factor_graph::bayes_tree
