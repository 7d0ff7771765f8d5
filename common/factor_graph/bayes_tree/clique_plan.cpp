#include "common/factor_graph/bayes_tree/clique_plan.hpp"

#include <ccolamd.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace understory::factor_graph::bayes_tree {
namespace {

constexpr int kNone = -1;
/// From so much work on a dissection, which takes a millisecond, may pay [flops]; and if the work
/// is so many times what the largest element alone costs in any order.
constexpr double kMuchWork = 5e6;
constexpr double kRoomForLess = 2.0;

/// Time of one front [us], fitted to the kernel: overhead, moving its numbers, eliminating.
double front_cost(double pivots, double separator) {
  const double size = pivots + separator + 1.0;
  return 0.25 + 0.0006 * size * size + 0.00015 * elimination_flops(pivots, separator + 1.0);
}

}  // namespace

void CliquePlanner::clear(std::span<const int> dimensions) {
  dimensions_.assign(dimensions.begin(), dimensions.end());
  group_.assign(dimensions.size(), 0);
  element_starts_.clear();
  entries_.clear();
}

void CliquePlanner::find_neighbours() {
  for (int e = 0; e < element_count(); ++e) {
    const std::span<const int> tied = element(e);
    const bool is_near = std::any_of(tied.begin(), tied.end(), [&](int v) {
      return group_[static_cast<std::size_t>(v)] == kLast;
    });
    if (!is_near) continue;
    for (const int v : tied) {
      int& group = group_[static_cast<std::size_t>(v)];
      group = std::max<int>(group, kNeighbours);
    }
  }
}

/// Few variables: as they came, those of the later groups behind.
void CliquePlanner::order_few() {
  order_.resize(dimensions_.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [&](int v, int w) {
    return group_[static_cast<std::size_t>(v)] < group_[static_cast<std::size_t>(w)];
  });
}

void CliquePlanner::order() {
  find_neighbours();
  if (size() <= 3) return order_few();
  const auto count = dimensions_.size();
  column_starts_.assign(count + 1, 0);
  for (const int v : entries_) ++column_starts_[static_cast<std::size_t>(v) + 1];
  std::partial_sum(column_starts_.begin(), column_starts_.end(), column_starts_.begin());
  const std::size_t space =
      ccolamd_recommended(static_cast<int>(entries_.size()), element_count(), size());
  if (row_indices_.size() < space) row_indices_.resize(space + space / 2);
  order_.assign(column_starts_.begin(), column_starts_.end() - 1);  // where to write next
  for (int e = 0; e < element_count(); ++e) {
    for (const int v : element(e)) {
      int& next = order_[static_cast<std::size_t>(v)];
      row_indices_[static_cast<std::size_t>(next++)] = e;
    }
  }
  int statistics[CCOLAMD_STATS];
  double knobs[CCOLAMD_KNOBS];
  ccolamd_set_defaults(knobs);
  if (ccolamd(element_count(), size(), static_cast<int>(row_indices_.size()), row_indices_.data(),
              column_starts_.data(), knobs, statistics, group_.data()) == 0) {
    throw std::logic_error("CCOLAMD refused a graph");
  }
  order_.assign(column_starts_.begin(), column_starts_.end() - 1);
}

/// Of eliminating the largest element.
double CliquePlanner::least_flops() const {
  double largest = 0.0;
  for (int e = 0; e < element_count(); ++e) {
    double rows = 0.0;
    for (const int v : element(e)) rows += dimensions_[static_cast<std::size_t>(v)];
    largest = std::max(largest, rows);
  }
  return elimination_flops(largest, 0.0);
}

double CliquePlanner::flops() const {
  double sum = 0.0;
  for (const Draft& draft : drafts_) {
    if (draft.alive) sum += elimination_flops(draft.pivots, draft.separator_size + 1.0);
  }
  return sum;
}

/// False where there is none.
bool CliquePlanner::order_by_dissection() {
  std::vector<int> number_of(dimensions_.size(), kNone);
  std::vector<int> divided;
  for (int v = 0; v < size(); ++v) {
    if (group_[static_cast<std::size_t>(v)] == kLast) continue;
    number_of[static_cast<std::size_t>(v)] = static_cast<int>(divided.size());
    divided.push_back(v);
  }
  const std::vector<int> order = dissect(elements(), number_of, static_cast<int>(divided.size()));
  if (order.empty()) return false;
  // Those that come last already are.
  for (std::size_t p = 0; p < order.size(); ++p) {
    order_[p] = divided[static_cast<std::size_t>(order[p])];
  }
  return true;
}

/// Hands every element to the first of its variables.
void CliquePlanner::sort_elements() {
  const auto count = dimensions_.size();
  positions_.resize(count);
  for (std::size_t p = 0; p < count; ++p) {
    positions_[static_cast<std::size_t>(order_[p])] = static_cast<int>(p);
  }
  first_element_.assign(count, kNone);
  plan_.next_element.assign(static_cast<std::size_t>(element_count()), kNone);
  for (int e = element_count(); e-- > 0;) {
    int first = size();
    for (const int v : element(e)) first = std::min(first, positions_[static_cast<std::size_t>(v)]);
    if (first == size()) continue;
    plan_.next_element[static_cast<std::size_t>(e)] =
        first_element_[static_cast<std::size_t>(first)];
    first_element_[static_cast<std::size_t>(first)] = e;
  }
}

/// What the variable at `position` is tied to among the later ones.
void CliquePlanner::draft(int position) {
  const auto at = static_cast<std::size_t>(position);
  Draft& draft = drafts_[at];
  const int dimension = dimensions_[static_cast<std::size_t>(order_[at])];
  draft = {position, position, 1,     dimension, static_cast<int>(separators_.size()),
           0,        0,        kNone, true};
  const auto tie = [&](int other) {
    if (other <= position || marker_[static_cast<std::size_t>(other)] == position) return;
    marker_[static_cast<std::size_t>(other)] = position;
    separators_.push_back(other);
    draft.separator_size +=
        dimensions_[static_cast<std::size_t>(order_[static_cast<std::size_t>(other)])];
  };
  for (int e = first_element_[at]; e != kNone;
       e = plan_.next_element[static_cast<std::size_t>(e)]) {
    for (const int v : element(e)) tie(positions_[static_cast<std::size_t>(v)]);
  }
  for (int c = children_[at]; c != kNone; c = drafts_[static_cast<std::size_t>(c)].next) {
    const Draft& child = drafts_[static_cast<std::size_t>(c)];
    // By number: tie() makes the list longer.
    const auto first = static_cast<std::size_t>(child.first_separator);
    const auto count = static_cast<std::size_t>(child.separator_count);
    for (std::size_t i = first; i < first + count; ++i) tie(separators_[i]);
  }
  draft.separator_count = static_cast<int>(separators_.size()) - draft.first_separator;
  next_frontal_[at] = kNone;
}

/// A child whose columns can as well be eliminated with its parent's joins it.
void CliquePlanner::merge_children(int position, int first_child) {
  Draft& parent = drafts_[static_cast<std::size_t>(position)];
  for (int c = first_child; c != kNone;) {
    Draft& child = drafts_[static_cast<std::size_t>(c)];
    const int next = child.next;
    const double apart = front_cost(parent.pivots, parent.separator_size) +
                         front_cost(child.pivots, child.separator_size);
    if (front_cost(parent.pivots + child.pivots, parent.separator_size) <= apart) {
      child.alive = false;
      next_frontal_[static_cast<std::size_t>(child.last_frontal)] = parent.first_frontal;
      parent.first_frontal = child.first_frontal;
      parent.frontal_count += child.frontal_count;
      parent.pivots += child.pivots;
    }
    c = next;
  }
}

void CliquePlanner::write() {
  plan_.cliques.clear();
  plan_.rows.clear();
  for (Draft& draft : drafts_) {
    if (!draft.alive) continue;
    CliquePlan::Clique clique;
    clique.first_row = static_cast<int>(plan_.rows.size());
    clique.frontal_count = draft.frontal_count;
    clique.row_count = draft.frontal_count + draft.separator_count;
    clique.first_element = kNone;
    int* tail = &clique.first_element;
    for (int p = draft.first_frontal; p != kNone; p = next_frontal_[static_cast<std::size_t>(p)]) {
      plan_.rows.push_back(order_[static_cast<std::size_t>(p)]);
      *tail = first_element_[static_cast<std::size_t>(p)];
      while (*tail != kNone) tail = &plan_.next_element[static_cast<std::size_t>(*tail)];
    }
    const auto begin = separators_.begin() + draft.first_separator;
    std::sort(begin, begin + draft.separator_count);
    for (int i = 0; i < draft.separator_count; ++i) {
      plan_.rows.push_back(order_[static_cast<std::size_t>(begin[i])]);
    }
    plan_.cliques.push_back(clique);
  }
}

void CliquePlanner::draft_all() {
  sort_elements();
  const auto count = dimensions_.size();
  drafts_.resize(count);
  children_.assign(count, kNone);
  next_frontal_.resize(count);
  marker_.assign(count, kNone);
  separators_.clear();
  for (int p = 0; p < size(); ++p) {
    draft(p);
    Draft& done = drafts_[static_cast<std::size_t>(p)];
    merge_children(p, children_[static_cast<std::size_t>(p)]);
    if (done.separator_count == 0) continue;
    const auto begin = separators_.begin() + done.first_separator;
    const int parent = *std::min_element(begin, begin + done.separator_count);
    done.next = children_[static_cast<std::size_t>(parent)];
    children_[static_cast<std::size_t>(parent)] = p;
  }
}

const CliquePlan& CliquePlanner::plan() {
  order();
  draft_all();
  const double work = flops();
  if (work > kMuchWork && work > kRoomForLess * least_flops()) {
    const std::vector<int> before = order_;
    if (order_by_dissection()) draft_all();
    if (flops() > work) {
      order_ = before;
      draft_all();
    }
  }
  write();
  return plan_;
}

}  // namespace understory::factor_graph::bayes_tree
