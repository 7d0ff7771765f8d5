#include "common/factor_graph/bayes_tree/restructuring.hpp"

namespace understory::factor_graph::bayes_tree {

void Restructuring::collect_variable(int variable) {
  if (affected_at_[static_cast<std::size_t>(variable)] != graph::kNone) return;
  affected_at_[static_cast<std::size_t>(variable)] = static_cast<int>(affected_.size());
  affected_.push_back(variable);
}

/// Collects the variables, factors and unchanged subtrees of a clique that is removed.
void Restructuring::take_apart(int clique, const Marks& marks) {
  const CliqueRecord record = cliques_[clique];

  for (int i = 0; i < record.frontal_count; ++i) {
    const int name = record.rows[i];
    if (graph_.variable(name).degree > 0) {
      collect_variable(name);
    } else {
      graph_.edit_variable(name).clique = graph::kNone;
    }
  }

  for (const int f : record.assembled())
    if (f != graph::kNone) element_factors_.push_back(f);
  for (int c = record.first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    if (!marks.is_structural(c)) orphans_.push_back(c);
  }
}

void Restructuring::collect(std::span<const int> fresh, const Marks& marks) {
  affected_.clear();
  element_factors_.clear();
  orphans_.clear();
  affected_at_.resize(static_cast<std::size_t>(graph_.variable_capacity()), graph::kNone);

  for (const int c : marks.structural()) take_apart(c, marks);
  for (const int f : fresh) {
    element_factors_.push_back(f);
    for (const int v : graph_.variables_of(f)) collect_variable(v);
  }
}

const CliquePlan& Restructuring::plan(std::span<const int> last) {
  dimensions_.clear();
  for (const int v : affected_) dimensions_.push_back(dimension(graph_.variable(v).type));
  planner_.clear(dimensions_);

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
  return planner_.plan();
}

int Restructuring::build_clique(const CliquePlan& plan, int planned) {
  const CliquePlan::Clique& from = plan.cliques[static_cast<std::size_t>(planned)];
  const int id = cliques_.add(from.frontal_count, from.row_count);
  CliqueRecord& clique = cliques_.edit(id);

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

/// Assigns factors and unchanged subtrees to the new clique if it is the first to eliminate one of
/// their variables.
void Restructuring::hand_out_elements(const CliquePlan& plan, int planned, int id) {
  factors_.clear();
  const auto factor_count = element_factors_.size();
  for (int e = plan.cliques[static_cast<std::size_t>(planned)].first_element;
       e != CliquePlan::kNoElement; e = plan.next_element[static_cast<std::size_t>(e)]) {
    const auto at = static_cast<std::size_t>(e);
    if (at < factor_count) {
      factors_.push_back(element_factors_[at]);
    } else {
      cliques_.link(id, orphans_[at - factor_count]);
    }
  }
  cliques_.set_factors(id, factors_);
}

/// The parent eliminates the first variable of the clique's separator.
void Restructuring::link_to_parent(int id) {
  const CliqueRecord& clique = cliques_[id];
  const bool is_root = clique.frontal_count == clique.row_count;
  const int parent =
      is_root ? CliqueTree::kRoot : graph_.variable(clique.rows[clique.frontal_count]).clique;
  cliques_.link(parent, id);
}

void Restructuring::build(const CliquePlan& plan, std::vector<int>& computed) {
  const std::size_t first = computed.size();
  for (std::size_t i = 0; i < plan.cliques.size(); ++i) {
    const int id = build_clique(plan, static_cast<int>(i));
    computed.push_back(id);
    cliques_.count_work(id);
    hand_out_elements(plan, static_cast<int>(i), id);
  }
  for (std::size_t i = first; i < computed.size(); ++i) link_to_parent(computed[i]);
}

void Restructuring::rebuild(std::span<const int> fresh, std::span<const int> last,
                            const Marks& marks, std::vector<int>& computed) {
  collect(fresh, marks);
  cliques_.remove(marks.structural());
  if (!affected_.empty()) build(plan(last), computed);

  for (const int v : affected_) affected_at_[static_cast<std::size_t>(v)] = graph::kNone;
}

}  // namespace understory::factor_graph::bayes_tree
