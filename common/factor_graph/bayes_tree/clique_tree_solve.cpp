// Back-substitution, as far down as something changes.
#include <algorithm>
#include <cmath>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"

namespace understory::factor_graph::bayes_tree {

void CliqueTree::solve_clique(int id, double finest) {
  const CliqueRecord& clique = cliques_[id];
  step_.resize(static_cast<std::size_t>(clique.size));
  int row = clique.pivots;
  for (int i = clique.frontal_count; i < clique.row_count; ++i) {
    const graph::VariableRecord& variable = graph_.variable(clique.rows[i]);
    const int size = dimension(variable.type);
    std::copy_n(variable.delta.begin(), size, step_.begin() + row);
    row += size;
  }
  kernel_.back_substitute(clique.panel, clique.size, clique.pivots, step_.data());
  int first = 0;
  for (int i = 0; i < clique.frontal_count; ++i) {
    const int name = clique.rows[i];
    const graph::VariableRecord& variable = graph_.variable(name);
    const int size = dimension(variable.type);
    double largest = 0.0;
    const double* to = step_.data() + first;
    for (int c = 0; c < size; ++c) {
      const double* column = clique.panel + static_cast<std::ptrdiff_t>(first + c) * clique.size;
      double whitened = 0.0;
      for (int r = c; r < size; ++r) {
        whitened += column[first + r] * (to[r] - variable.delta[static_cast<std::size_t>(r)]);
      }
      largest = std::max(largest, std::abs(whitened));
    }
    if (largest > finest) {
      std::uint64_t& changed_at = changed_at_[static_cast<std::size_t>(name)];
      if (changed_at != solve_count_) {
        changed_at = solve_count_;
        changed_.push_back(name);
        changed_from_.push_back(variable.delta);
        change_size_[static_cast<std::size_t>(name)] = 0.0;
      }
      double& change_size = change_size_[static_cast<std::size_t>(name)];
      change_size = std::max(change_size, largest);
      graph_.move(name, to);
    }
    first += size;
  }
}

void CliqueTree::queue(int clique) {
  is_waiting_.resize(mark_.size(), 0);
  char& is_waiting = is_waiting_[static_cast<std::size_t>(clique)];
  if (is_waiting == 0) waiting_.push_back(clique);
  is_waiting = 1;
}

void CliqueTree::forget_waiting() {
  for (const int c : waiting_) is_waiting_[static_cast<std::size_t>(c)] = 0;
  waiting_.clear();
}

/// Largest change in this solve of the clique's rows from `from` on [own conditional deviations].
double CliqueTree::change_of_rows(const CliqueRecord& clique, int from) const {
  double largest = 0.0;
  for (int i = from; i < clique.row_count; ++i) {
    const auto name = static_cast<std::size_t>(clique.rows[i]);
    if (changed_at_[name] == solve_count_) largest = std::max(largest, change_size_[name]);
  }
  return largest;
}

/// Children whose separator moved much have their turn now, those where it moved a little later.
void CliqueTree::push_children(int id, double at_once) {
  const bool any = solve_everything_ || change_of_rows(cliques_[id], 0) > 0.0;
  if (!any) return;
  for (int c = cliques_[id].first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    // Those of made_ have their turn anyway.
    if (pending_[static_cast<std::size_t>(c)] != 0) continue;
    const double change = change_of_rows(cliques_[c], cliques_[c].frontal_count);
    if (solve_everything_ || change > at_once) {
      stack_.push_back(c);
    } else if (change > 0.0) {
      queue(c);
    }
  }
}

void CliqueTree::solve_from(int id, const MoveLimits& limits) {
  stack_.assign(1, id);
  while (!stack_.empty()) {
    const int c = stack_.back();
    stack_.pop_back();
    solve_clique(c, limits.finest);
    push_children(c, limits.at_once);
  }
}

/// The first of the queue.
void CliqueTree::take_slots(const MoveLimits& limits) {
  const auto count = std::min(waiting_.size(), static_cast<std::size_t>(limits.turns));
  for (std::size_t i = 0; i < count; ++i) {
    const int c = waiting_[i];
    char& is_waiting = is_waiting_[static_cast<std::size_t>(c)];
    if (is_waiting == 0) continue;
    is_waiting = 0;
    solve_from(c, limits);
  }
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
}

void CliqueTree::solve(const MoveLimits& limits) {
  ++solve_count_;
  changed_.clear();
  changed_from_.clear();
  changed_at_.resize(static_cast<std::size_t>(graph_.variable_capacity()), 0);
  change_size_.resize(static_cast<std::size_t>(graph_.variable_capacity()));
  pending_.resize(static_cast<std::size_t>(cliques_.size()), 0);
  for (const int c : made_) pending_[static_cast<std::size_t>(c)] = 1;
  for (std::size_t i = made_.size(); i-- > 0;) {
    solve_from(made_[i], limits);
  }
  for (const int c : made_) pending_[static_cast<std::size_t>(c)] = 0;
  take_slots(limits);
}

void CliqueTree::solve_everything(double threshold) {
  forget_waiting();
  made_.clear();
  for (int c = cliques_[kRoot].first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    made_.push_back(c);
  }
  solve_everything_ = true;
  solve({threshold, threshold, 0});
  solve_everything_ = false;
}

}  // namespace understory::factor_graph::bayes_tree
