#include "common/factor_graph/bayes_tree/clique_tree.hpp"

#include <algorithm>

namespace understory::factor_graph::bayes_tree {

CliqueTree::CliqueTree(graph::FactorGraph& graph) : graph_(graph), kernel_(front_kernel()) {
  cliques_.add();
  mark_.push_back(kClean);
  commit();
}

void CliqueTree::mark_structure_from(int clique) {
  for (int c = clique; c != kRoot; c = cliques_[c].parent) {
    char& mark = mark_[static_cast<std::size_t>(c)];
    if (mark == kStructural) return;
    mark = kStructural;
    structural_.push_back(c);
  }
}

void CliqueTree::mark_numbers_from(int clique) {
  for (int c = clique; c != kRoot; c = cliques_[c].parent) {
    char& mark = mark_[static_cast<std::size_t>(c)];
    if (mark != kClean) return;
    mark = kDirty;
    dirty_.push_back(c);
  }
}

void CliqueTree::mark_structure(int variable) {
  const int clique = graph_.variable(variable).clique;
  if (clique != graph::kNone) mark_structure_from(clique);
}

void CliqueTree::mark_numbers(int factor) {
  const int clique = graph_.factor(factor).clique;
  if (clique != graph::kNone) mark_numbers_from(clique);
}

void CliqueTree::mark_everything() {
  for (int v = 0; v < graph_.variable_capacity(); ++v) {
    if (graph_.variable(v).in_use) mark_structure(v);
  }
}

void CliqueTree::detach(int factor) {
  const int clique = graph_.factor(factor).clique;
  if (clique == graph::kNone) return;
  mark_structure_from(clique);
  const int next = graph_.factor(factor).next;
  if (cliques_[clique].first_factor == factor) {
    cliques_.edit(clique).first_factor = next;
  } else {
    int before = cliques_[clique].first_factor;
    while (graph_.factor(before).next != factor) before = graph_.factor(before).next;
    graph_.edit_factor(before).next = next;
  }
  graph_.edit_factor(factor).clique = graph::kNone;
}

void CliqueTree::clear_marks() {
  for (const int c : structural_) mark_[static_cast<std::size_t>(c)] = kClean;
  for (const int c : dirty_) mark_[static_cast<std::size_t>(c)] = kClean;
  structural_.clear();
  dirty_.clear();
}

void CliqueTree::free_blocks(const CliqueRecord& clique) {
  if (clique.rows != nullptr) {
    rows_.give_back(clique.rows, static_cast<std::size_t>(clique.row_count));
  }
  if (clique.panel != nullptr) pool_.give_back(clique.panel, clique.numbers());
}

void CliqueTree::link_child(int parent, int child) {
  const int sibling = cliques_[parent].first_child;
  CliqueRecord& record = cliques_.edit(child);
  record.parent = parent;
  record.next_sibling = sibling;
  record.previous_sibling = graph::kNone;
  if (sibling != graph::kNone) cliques_.edit(sibling).previous_sibling = child;
  cliques_.edit(parent).first_child = child;
}

void CliqueTree::unlink_from_root(int child) {
  const CliqueRecord record = cliques_[child];
  if (record.previous_sibling == graph::kNone) {
    cliques_.edit(kRoot).first_child = record.next_sibling;
  } else {
    cliques_.edit(record.previous_sibling).next_sibling = record.next_sibling;
  }
  if (record.next_sibling != graph::kNone) {
    cliques_.edit(record.next_sibling).previous_sibling = record.previous_sibling;
  }
}

/// The root keeps how many cliques lack information.
void CliqueTree::count_left_out(int change) {
  if (change != 0) cliques_.edit(kRoot).left_out += change;
}

std::vector<int> CliqueTree::undetermined() const {
  std::vector<int> variables;
  if (undetermined_cliques() == 0) return variables;
  for (int c = 1; c < cliques_.size(); ++c) {
    const CliqueRecord& clique = cliques_[c];
    if (clique.panel == nullptr || clique.left_out == 0 || clique.parent == graph::kNone) continue;
    int column = 0;
    for (int i = 0; i < clique.frontal_count; ++i) {
      const int name = clique.rows[i];
      const int size = dimension(graph_.variable(name).type);
      bool is_left_out = false;
      for (int k = 0; k < size; ++k, ++column) {
        const double* l = clique.panel + static_cast<std::ptrdiff_t>(column) * clique.size;
        // A column of the identity: no measurement gives exactly that.
        const bool identity = l[column] == 1.0 && std::all_of(l + column + 1, l + clique.size,
                                                              [](double x) { return x == 0.0; });
        is_left_out = is_left_out || identity;
      }
      if (is_left_out) variables.push_back(name);
    }
  }
  return variables;
}

void CliqueTree::commit() {
  cliques_.commit([&](const CliqueRecord& gone) { free_blocks(gone); },
                  [&](const CliqueRecord& before, const CliqueRecord& now) {
                    if (before.panel != nullptr && before.panel != now.panel) {
                      pool_.give_back(before.panel, before.numbers());
                    }
                  });
  saved_marks_.structural.assign(structural_.begin(), structural_.end());
  saved_marks_.dirty.assign(dirty_.begin(), dirty_.end());
  saved_marks_.waiting.clear();
  for (const int c : waiting_) {
    if (is_waiting_[static_cast<std::size_t>(c)] != 0) saved_marks_.waiting.push_back(c);
  }
  saved_marks_.total_flops = total_flops_;
}

void CliqueTree::rollback() {
  clear_marks();
  cliques_.rollback(
      [&](const CliqueRecord& now, const CliqueRecord& before) {
        if (now.panel != before.panel) pool_.give_back(now.panel, now.numbers());
      },
      [&](const CliqueRecord& gone) { free_blocks(gone); });
  mark_.resize(static_cast<std::size_t>(cliques_.size()));
  structural_.assign(saved_marks_.structural.begin(), saved_marks_.structural.end());
  dirty_.assign(saved_marks_.dirty.begin(), saved_marks_.dirty.end());
  // In the order of marking: what was dirty first may have become structural.
  for (const int c : dirty_) mark_[static_cast<std::size_t>(c)] = kDirty;
  for (const int c : structural_) mark_[static_cast<std::size_t>(c)] = kStructural;
  forget_waiting();
  for (const int c : saved_marks_.waiting) queue(c);
  total_flops_ = saved_marks_.total_flops;
}

}  // namespace understory::factor_graph::bayes_tree
