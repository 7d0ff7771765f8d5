#include "common/factor_graph/bayes_tree/clique_drafts.hpp"

#include <algorithm>

#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {
double CliqueDrafts::flops() const {
  double sum = 0.0;
  for (const Draft& draft : drafts_) {
    if (draft.alive) sum += elimination_flops(draft.pivots, draft.separator_size + 1.0);
  }
  return sum;
}

/// Assigns every element to the first of its variables.
void CliqueDrafts::sort_elements(const EliminationProblem& problem, std::span<const int> order) {
  const auto count = order.size();
  positions_.resize(count);
  for (std::size_t p = 0; p < count; ++p) {
    positions_[static_cast<std::size_t>(order[p])] = static_cast<int>(p);
  }

  first_element_.assign(count, graph::kNone);
  plan_.next_element.assign(static_cast<std::size_t>(problem.element_count()), graph::kNone);
  for (int e = problem.element_count(); e-- > 0;) {
    int first = problem.size();
    for (const int v : problem.element(e)) {
      first = std::min(first, positions_[static_cast<std::size_t>(v)]);
    }
    if (first == problem.size()) continue;
    plan_.next_element[static_cast<std::size_t>(e)] =
        first_element_[static_cast<std::size_t>(first)];
    first_element_[static_cast<std::size_t>(first)] = e;
  }
}

/// Finds the later variables connected to the variable at `position`.
void CliqueDrafts::draft(const EliminationProblem& problem, std::span<const int> order,
                         int position) {
  const auto at = static_cast<std::size_t>(position);
  Draft& draft = drafts_[at];
  draft = {position,
           position,
           1,
           problem.dimension(order[at]),
           static_cast<int>(separators_.size()),
           0,
           0,
           graph::kNone,
           true};
  const auto tie = [&](int other) {
    if (other <= position || marker_[static_cast<std::size_t>(other)] == position) return;
    marker_[static_cast<std::size_t>(other)] = position;
    separators_.push_back(other);
    draft.separator_size += problem.dimension(order[static_cast<std::size_t>(other)]);
  };

  for (int e = first_element_[at]; e != graph::kNone;
       e = plan_.next_element[static_cast<std::size_t>(e)]) {
    for (const int v : problem.element(e)) tie(positions_[static_cast<std::size_t>(v)]);
  }
  for (int c = children_[at]; c != graph::kNone; c = drafts_[static_cast<std::size_t>(c)].next) {
    const Draft& child = drafts_[static_cast<std::size_t>(c)];
    // Indexed, because tie() extends the list.
    const auto first = static_cast<std::size_t>(child.first_separator);
    const auto count = static_cast<std::size_t>(child.separator_count);
    for (std::size_t i = first; i < first + count; ++i) tie(separators_[i]);
  }

  draft.separator_count = static_cast<int>(separators_.size()) - draft.first_separator;
  next_frontal_[at] = graph::kNone;
}

/// Merges a child into its parent if one front costs less time than two.
void CliqueDrafts::merge_children(int position, int first_child) {
  Draft& parent = drafts_[static_cast<std::size_t>(position)];
  for (int c = first_child; c != graph::kNone;) {
    Draft& child = drafts_[static_cast<std::size_t>(c)];
    const int next = child.next;
    const double apart = front_time_us(parent.pivots, parent.separator_size) +
                         front_time_us(child.pivots, child.separator_size);
    if (front_time_us(parent.pivots + child.pivots, parent.separator_size) <= apart) {
      child.alive = false;
      next_frontal_[static_cast<std::size_t>(child.last_frontal)] = parent.first_frontal;
      parent.first_frontal = child.first_frontal;
      parent.frontal_count += child.frontal_count;
      parent.pivots += child.pivots;
    }
    c = next;
  }
}

void CliqueDrafts::draft_all(const EliminationProblem& problem, std::span<const int> order) {
  sort_elements(problem, order);
  const auto count = order.size();
  drafts_.resize(count);
  children_.assign(count, graph::kNone);
  next_frontal_.resize(count);
  marker_.assign(count, graph::kNone);
  separators_.clear();

  for (int p = 0; p < problem.size(); ++p) {
    draft(problem, order, p);
    Draft& done = drafts_[static_cast<std::size_t>(p)];
    merge_children(p, children_[static_cast<std::size_t>(p)]);
    if (done.separator_count == 0) continue;

    // The parent eliminates the first variable of the separator.
    const auto begin = separators_.begin() + done.first_separator;
    const int parent = *std::min_element(begin, begin + done.separator_count);
    done.next = children_[static_cast<std::size_t>(parent)];
    children_[static_cast<std::size_t>(parent)] = p;
  }
}

void CliqueDrafts::append(const Draft& draft, std::span<const int> order) {
  CliquePlan::Clique clique;
  clique.first_row = static_cast<int>(plan_.rows.size());
  clique.frontal_count = draft.frontal_count;
  clique.row_count = draft.frontal_count + draft.separator_count;

  // Collect the merged variables' elements in one list.
  clique.first_element = graph::kNone;
  int* tail = &clique.first_element;
  for (int p = draft.first_frontal; p != graph::kNone;
       p = next_frontal_[static_cast<std::size_t>(p)]) {
    plan_.rows.push_back(order[static_cast<std::size_t>(p)]);
    *tail = first_element_[static_cast<std::size_t>(p)];
    while (*tail != graph::kNone) tail = &plan_.next_element[static_cast<std::size_t>(*tail)];
  }

  const auto begin = separators_.begin() + draft.first_separator;
  std::sort(begin, begin + draft.separator_count);
  for (int i = 0; i < draft.separator_count; ++i) {
    plan_.rows.push_back(order[static_cast<std::size_t>(begin[i])]);
  }
  plan_.cliques.push_back(clique);
}

const CliquePlan& CliqueDrafts::write(std::span<const int> order) {
  plan_.cliques.clear();
  plan_.rows.clear();
  for (const Draft& draft : drafts_) {
    if (draft.alive) append(draft, order);
  }
  return plan_;
}

}  // namespace understory::factor_graph::bayes_tree
