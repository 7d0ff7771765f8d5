#include "common/factor_graph/bayes_tree/clique_plan.hpp"

#include <ccolamd.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

/// Least work [flops] for which a dissection may pay (it takes a millisecond for 200 variables),
/// and least ratio of the work to the lower bound from the largest element. Few variables are
/// divided only once or twice, which gains little: for these the fronts must take 2 ms.
constexpr double kMuchWork = 5e6;
constexpr double kMuchWorkOfFew = 2e7;
constexpr int kFew = 400;
constexpr double kRoomForLess = 2.0;

}  // namespace

/// Few variables: in the given order, later groups last.
void CliquePlanner::order_few() {
  order_.resize(static_cast<std::size_t>(problem_.size()));
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(),
                   [&](int v, int w) { return problem_.group(v) < problem_.group(w); });
}

void CliquePlanner::order() {
  problem_.find_neighbours();
  if (problem_.size() <= 3) return order_few();
  if (problem_.size() <= MinimumDegree::kMost) return minimum_degree_.order(problem_, order_);

  // Start of each variable's list of elements.
  const std::span<const int> entries = problem_.entries();
  column_starts_.assign(static_cast<std::size_t>(problem_.size()) + 1, 0);
  for (const int v : entries) ++column_starts_[static_cast<std::size_t>(v) + 1];
  std::partial_sum(column_starts_.begin(), column_starts_.end(), column_starts_.begin());

  // Write the lists; order_ has the next index of each.
  const std::size_t space = ccolamd_recommended(static_cast<int>(entries.size()),
                                                problem_.element_count(), problem_.size());
  if (row_indices_.size() < space) row_indices_.resize(space + space / 2);
  order_.assign(column_starts_.begin(), column_starts_.end() - 1);
  for (int e = 0; e < problem_.element_count(); ++e) {
    for (const int v : problem_.element(e)) {
      int& next = order_[static_cast<std::size_t>(v)];
      row_indices_[static_cast<std::size_t>(next++)] = e;
    }
  }

  int statistics[CCOLAMD_STATS];
  double knobs[CCOLAMD_KNOBS];
  ccolamd_set_defaults(knobs);
  if (ccolamd(problem_.element_count(), problem_.size(), static_cast<int>(row_indices_.size()),
              row_indices_.data(), column_starts_.data(), knobs, statistics,
              problem_.groups().data()) == 0) {
    throw std::logic_error("CCOLAMD refused a graph");
  }
  order_.assign(column_starts_.begin(), column_starts_.end() - 1);
}

/// False where there is no such order.
bool CliquePlanner::order_by_dissection() {
  std::vector<int> number_of(static_cast<std::size_t>(problem_.size()), graph::kNone);
  std::vector<int> divided;
  for (int v = 0; v < problem_.size(); ++v) {
    if (problem_.group(v) == EliminationProblem::kLast) continue;
    number_of[static_cast<std::size_t>(v)] = static_cast<int>(divided.size());
    divided.push_back(v);
  }

  const std::vector<int> order =
      dissect(problem_.elements(), number_of, static_cast<int>(divided.size()));
  if (order.empty()) return false;
  // Variables of the last group are already at the end.
  for (std::size_t p = 0; p < order.size(); ++p) {
    order_[p] = divided[static_cast<std::size_t>(order[p])];
  }
  return true;
}

const CliquePlan& CliquePlanner::plan() {
  order();
  drafts_.draft_all(problem_, order_);

  const double work = drafts_.flops();
  const double much = problem_.size() < kFew ? kMuchWorkOfFew : kMuchWork;
  if (work > much && work > kRoomForLess * problem_.least_flops()) {
    const std::vector<int> before = order_;
    if (order_by_dissection()) drafts_.draft_all(problem_, order_);
    if (drafts_.flops() > work) {
      order_ = before;
      drafts_.draft_all(problem_, order_);
    }
  }

  return drafts_.write(order_);
}

}  // namespace understory::factor_graph::bayes_tree
