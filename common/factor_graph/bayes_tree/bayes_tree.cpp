#include "common/factor_graph/bayes_tree/bayes_tree.hpp"

#include <algorithm>

namespace understory::factor_graph::bayes_tree {
namespace {

/// True for a column of the identity: a pivot without information; no measurement has exactly this
/// column.
bool is_left_out(const CliqueRecord& clique, int column) {
  const double* l = clique.panel + static_cast<std::ptrdiff_t>(column) * clique.size;
  return l[column] == 1.0 &&
         std::all_of(l + column + 1, l + clique.size, [](double x) { return x == 0.0; });
}

}  // namespace

BayesTree::BayesTree(graph::FactorGraph& graph, std::size_t undo_bytes)
    : graph_(graph),
      cliques_(undo_bytes),
      restructuring_(graph_, cliques_),
      elimination_(graph_, cliques_),
      back_substitution_(graph_, cliques_),
      covariance_(graph_, cliques_),
      marginals_(graph_, cliques_) {}

void BayesTree::mark_structure(int variable) {
  const int clique = graph_.variable(variable).clique;
  if (clique != graph::kNone) marks_.mark_structure(cliques_, clique);
}

void BayesTree::mark_numbers(int factor) {
  const int clique = cliques_.clique_of(factor);
  if (clique != graph::kNone) marks_.mark_numbers(cliques_, clique);
}

void BayesTree::mark_everything() {
  for (int v = 0; v < graph_.variable_capacity(); ++v) {
    if (graph_.variable(v).in_use) mark_structure(v);
  }
}

void BayesTree::detach(int factor) {
  const int clique = cliques_.clique_of(factor);
  if (clique == graph::kNone) return;
  marks_.mark_structure(cliques_, clique);
  cliques_.remove_factor(factor);
}

double BayesTree::eliminate(std::span<const int> fresh, std::span<const int> last) {
  // The variables that the new factors tie together are ordered anew.
  for (const int f : fresh) {
    for (const int v : graph_.variables_of(f)) mark_structure(v);
  }

  // First the cliques that keep their structure, then the new ones above them.
  elimination_.list_dirty(marks_, computed_);
  restructuring_.rebuild(fresh, last, marks_, computed_);

  // From here on the structure is final.
  marks_.clear();
  marks_.resize(cliques_.capacity());
  elimination_.factorise(computed_);
  double flops = 0.0;
  for (const int c : computed_) flops += flops_of(cliques_[c]);
  return flops;
}

void BayesTree::solve_everything(double threshold) {
  computed_.clear();
  for (int c = cliques_[CliqueTree::kRoot].first_child; c != graph::kNone;
       c = cliques_[c].next_sibling) {
    computed_.push_back(c);
  }
  back_substitution_.solve(computed_, threshold, true);
}

std::vector<int> BayesTree::undetermined() const {
  std::vector<int> variables;
  if (cliques_.undetermined_cliques() == 0) return variables;

  for (int c = 1; c < cliques_.capacity(); ++c) {
    const CliqueRecord& clique = cliques_[c];
    if (clique.panel == nullptr || clique.left_out == 0 || clique.parent == graph::kNone) continue;
    int column = 0;
    for (int i = 0; i < clique.frontal_count; ++i) {
      const int name = clique.rows[i];
      const int end = column + dimension(graph_.variable(name).type);
      bool any = false;
      for (; column < end; ++column) any = any || is_left_out(clique, column);
      if (any) variables.push_back(name);
    }
  }
  return variables;
}

void BayesTree::commit(bool is_whole) {
  cliques_.commit(is_whole && marks_.structural().empty() && marks_.dirty().empty());
  marks_.commit();
}

void BayesTree::rollback() {
  cliques_.rollback();
  marks_.rollback(cliques_.capacity());
  elimination_.restore_lost();
}

}  // namespace understory::factor_graph::bayes_tree
