#include "common/factor_graph/bayes_tree/marks.hpp"

namespace understory::factor_graph::bayes_tree {

void Marks::mark_structure(const CliqueTree& tree, int clique) {
  for (int c = clique; c != CliqueTree::kRoot; c = tree[c].parent) {
    char& mark = mark_[static_cast<std::size_t>(c)];
    if (mark == kStructural) return;
    mark = kStructural;
    structural_.push_back(c);
  }
}

void Marks::mark_numbers(const CliqueTree& tree, int clique) {
  for (int c = clique; c != CliqueTree::kRoot; c = tree[c].parent) {
    char& mark = mark_[static_cast<std::size_t>(c)];
    if (mark != kClean) return;
    mark = kDirty;
    dirty_.push_back(c);
  }
}

void Marks::clear() {
  for (const int c : structural_) mark_[static_cast<std::size_t>(c)] = kClean;
  for (const int c : dirty_) mark_[static_cast<std::size_t>(c)] = kClean;
  structural_.clear();
  dirty_.clear();
}

void Marks::commit() {
  saved_.structural.assign(structural_.begin(), structural_.end());
  saved_.dirty.assign(dirty_.begin(), dirty_.end());
}

void Marks::rollback(int cliques) {
  clear();
  mark_.resize(static_cast<std::size_t>(cliques));
  structural_.assign(saved_.structural.begin(), saved_.structural.end());
  dirty_.assign(saved_.dirty.begin(), saved_.dirty.end());
  // In the order of marking: a dirty clique may have become structural.
  for (const int c : dirty_) mark_[static_cast<std::size_t>(c)] = kDirty;
  for (const int c : structural_) mark_[static_cast<std::size_t>(c)] = kStructural;
}

}  // namespace understory::factor_graph::bayes_tree
