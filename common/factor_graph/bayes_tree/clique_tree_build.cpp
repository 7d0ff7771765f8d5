// The structure of the part of the tree that changed.
#include <algorithm>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

double flops_of(const CliqueRecord& clique) {
  return elimination_flops(clique.pivots, clique.size - clique.pivots);
}

}  // namespace

void CliqueTree::collect_variable(int variable) {
  if (affected_at_[static_cast<std::size_t>(variable)] != graph::kNone) return;
  affected_at_[static_cast<std::size_t>(variable)] = static_cast<int>(affected_.size());
  affected_.push_back(variable);
}

/// What a clique that is taken out of the tree leaves: its variables, factors, and the subtrees
/// below that stay whole.
void CliqueTree::take_apart(int clique) {
  const CliqueRecord record = cliques_[clique];
  for (int i = 0; i < record.frontal_count; ++i) {
    const int name = record.rows[i];
    if (graph_.variable(name).degree > 0) {
      collect_variable(name);
    } else {
      graph_.edit_variable(name).clique = graph::kNone;
    }
  }
  for (int f = record.first_factor; f != graph::kNone; f = graph_.factor(f).next) {
    element_factors_.push_back(f);
  }
  for (int c = record.first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    if (mark_[static_cast<std::size_t>(c)] != kStructural) orphans_.push_back(c);
  }
}

/// Removes the marked cliques from the tree; returns the work that they stood for.
double CliqueTree::remove_structure() {
  double flops = 0.0;
  for (const int c : structural_) {
    flops += flops_of(cliques_[c]);
    if (static_cast<std::size_t>(c) < is_waiting_.size()) {
      is_waiting_[static_cast<std::size_t>(c)] = 0;
    }
    if (cliques_[c].parent == kRoot) unlink_from_root(c);
    count_left_out(cliques_[c].left_out > 0 ? -1 : 0);
    cliques_.edit(c).parent = graph::kNone;
    cliques_.remove(c);
  }
  return flops;
}

void CliqueTree::collect(std::span<const int> fresh) {
  affected_.clear();
  element_factors_.clear();
  orphans_.clear();
  affected_at_.resize(static_cast<std::size_t>(graph_.variable_capacity()), graph::kNone);
  for (const int c : structural_) take_apart(c);
  for (const int f : fresh) {
    element_factors_.push_back(f);
    for (const int v : graph_.variables_of(f)) collect_variable(v);
  }
}

int CliqueTree::build_clique(const CliquePlan& plan, int planned) {
  const CliquePlan::Clique& from = plan.cliques[static_cast<std::size_t>(planned)];
  const int id = cliques_.add();
  if (mark_.size() <= static_cast<std::size_t>(id)) mark_.push_back(kClean);
  CliqueRecord& clique = cliques_.edit(id);
  clique.frontal_count = from.frontal_count;
  clique.row_count = from.row_count;
  clique.rows = rows_.take(static_cast<std::size_t>(from.row_count));
  clique.size = 1;
  for (int i = 0; i < from.row_count; ++i) {
    const int planned_row = from.first_row + i;
    const int planned_name = plan.rows[static_cast<std::size_t>(planned_row)];
    const int name = affected_[static_cast<std::size_t>(planned_name)];
    clique.rows[i] = name;
    const int size = dimension(graph_.variable(name).type);
    clique.size += size;
    if (i < from.frontal_count) {
      clique.pivots += size;
      graph_.edit_variable(name).clique = id;
    }
  }
  return id;
}

void CliqueTree::build(const CliquePlan& plan) {
  const std::size_t first = made_.size();
  const auto factor_count = element_factors_.size();
  for (std::size_t i = 0; i < plan.cliques.size(); ++i) {
    const int id = build_clique(plan, static_cast<int>(i));
    made_.push_back(id);
    total_flops_ += flops_of(cliques_[id]);
    for (int e = plan.cliques[i].first_element; e != CliquePlan::kNoElement;
         e = plan.next_element[static_cast<std::size_t>(e)]) {
      const auto at = static_cast<std::size_t>(e);
      if (at >= factor_count) {
        link_child(id, orphans_[at - factor_count]);
        continue;
      }
      graph::FactorRecord& factor = graph_.edit_factor(element_factors_[at]);
      CliqueRecord& clique = cliques_.edit(id);
      factor.clique = id;
      factor.next = clique.first_factor;
      clique.first_factor = element_factors_[at];
    }
  }
  for (std::size_t i = first; i < made_.size(); ++i) {
    const CliqueRecord& clique = cliques_[made_[i]];
    const bool is_root = clique.frontal_count == clique.row_count;
    link_child(is_root ? kRoot : graph_.variable(clique.rows[clique.frontal_count]).clique,
               made_[i]);
  }
}

TreeStatistics CliqueTree::eliminate(std::span<const int> fresh, std::span<const int> last) {
  TreeStatistics statistics;
  for (const int f : fresh) {
    for (const int v : graph_.variables_of(f)) mark_structure(v);
  }
  order_dirty();
  statistics.refreshed_cliques = static_cast<long>(made_.size());
  collect(fresh);
  total_flops_ -= remove_structure();
  if (!affected_.empty()) {
    stack_.clear();
    for (const int v : affected_) stack_.push_back(dimension(graph_.variable(v).type));
    planner_.clear(stack_);
    for (const int f : element_factors_) {
      planner_.begin_element();
      for (const int v : graph_.variables_of(f)) {
        planner_.add_to_element(affected_at_[static_cast<std::size_t>(v)]);
      }
    }
    for (const int c : orphans_) {
      planner_.begin_element();
      for (int i = cliques_[c].frontal_count; i < cliques_[c].row_count; ++i) {
        planner_.add_to_element(affected_at_[static_cast<std::size_t>(cliques_[c].rows[i])]);
      }
    }
    for (const int v : last) {
      const int at = affected_at_[static_cast<std::size_t>(v)];
      if (at != graph::kNone) planner_.set_last(at);
    }
    build(planner_.plan());
  }
  statistics.eliminated_variables = static_cast<long>(affected_.size());
  for (const int v : affected_) affected_at_[static_cast<std::size_t>(v)] = graph::kNone;
  clear_marks();
  for (const int c : made_) {
    factorise(c);
    statistics.flops += flops_of(cliques_[c]);
  }
  return statistics;
}

}  // namespace understory::factor_graph::bayes_tree
