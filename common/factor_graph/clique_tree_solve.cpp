// Back-substitution, as far down as something changes.
#include <algorithm>
#include <cmath>

#include "common/factor_graph/clique_tree.hpp"

namespace understory {

void CliqueTree::solve_clique(int id, double threshold) {
  const CliqueRecord& clique = cliques_[id];
  step_.resize(static_cast<std::size_t>(clique.size));
  int row = clique.pivots;
  for (int i = clique.frontal_count; i < clique.row_count; ++i) {
    const VariableRecord& variable = graph_.variable(clique.rows[i]);
    const int size = dimension(variable.type);
    std::copy_n(variable.delta.begin(), size, step_.begin() + row);
    row += size;
  }
  kernel_.back_substitute(clique.panel, clique.size, clique.pivots, step_.data());
  int first = 0;
  for (int i = 0; i < clique.frontal_count; ++i) {
    const int name = clique.rows[i];
    const VariableRecord& variable = graph_.variable(name);
    const int size = dimension(variable.type);
    double largest = 0.0;
    double squared = 0.0;
    for (int c = 0; c < size; ++c) {
      const double* column = clique.panel + static_cast<std::ptrdiff_t>(first + c) * clique.size;
      double whitened = 0.0;
      for (int r = c; r < size; ++r) {
        const auto at = static_cast<std::size_t>(r);
        whitened +=
            column[first + r] * (step_[static_cast<std::size_t>(first + r)] - variable.delta[at]);
      }
      largest = std::max(largest, std::abs(whitened));
      squared += whitened * whitened;
    }
    if (largest > threshold) {
      promised_decrease_ += squared;
      changed_.push_back(name);
      changed_from_.push_back(variable.delta);
      changed_at_[static_cast<std::size_t>(name)] = solve_count_;
      graph_.move(name, step_.data() + first);
    }
    first += size;
  }
}

bool CliqueTree::has_changed_row(const CliqueRecord& clique, int from) const {
  for (int i = from; i < clique.row_count; ++i) {
    if (changed_at_[static_cast<std::size_t>(clique.rows[i])] == solve_count_) return true;
  }
  return false;
}

void CliqueTree::push_children(int id) {
  for (int c = cliques_[id].first_child; c != kNone; c = cliques_[c].next_sibling) {
    // Those of made_ have their turn anyway.
    if (pending_[static_cast<std::size_t>(c)] == 0 &&
        (solve_everything_ || has_changed_row(cliques_[c], cliques_[c].frontal_count))) {
      stack_.push_back(c);
    }
  }
}

void CliqueTree::solve_below(int id, double threshold) {
  stack_.clear();
  if (solve_everything_ || has_changed_row(cliques_[id], 0)) push_children(id);
  while (!stack_.empty()) {
    const int c = stack_.back();
    stack_.pop_back();
    solve_clique(c, threshold);
    if (solve_everything_ || has_changed_row(cliques_[c], 0)) push_children(c);
  }
}

void CliqueTree::solve(double threshold) {
  ++solve_count_;
  promised_decrease_ = 0.0;
  changed_.clear();
  changed_from_.clear();
  changed_at_.resize(static_cast<std::size_t>(graph_.variable_capacity()), 0);
  pending_.resize(static_cast<std::size_t>(cliques_.size()), 0);
  for (const int c : made_) pending_[static_cast<std::size_t>(c)] = 1;
  for (std::size_t i = made_.size(); i-- > 0;) {
    solve_clique(made_[i], threshold);
    solve_below(made_[i], threshold);
  }
  for (const int c : made_) pending_[static_cast<std::size_t>(c)] = 0;
}

void CliqueTree::solve_everything(double threshold) {
  made_.clear();
  for (int c = cliques_[kRoot].first_child; c != kNone; c = cliques_[c].next_sibling) {
    made_.push_back(c);
  }
  solve_everything_ = true;
  solve(threshold);
  solve_everything_ = false;
}

}  // namespace understory
