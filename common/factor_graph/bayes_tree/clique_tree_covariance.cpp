// Covariances, along the paths from the variables' cliques to the root.
#include <algorithm>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

Eigen::Map<const Eigen::MatrixXd> panel_of(const CliqueRecord& clique) {
  return {clique.panel, clique.size, clique.pivots};
}

}  // namespace

/// Lists the cliques on the paths, children first, and gives their frontal variables rows.
void CliqueTree::collect_paths(std::span<const int> variables) {
  on_path_.resize(static_cast<std::size_t>(cliques_.size()), 0);
  pending_.resize(static_cast<std::size_t>(cliques_.size()), 0);
  path_.clear();
  stack_.clear();
  for (const int v : variables) {
    for (int c = graph_.variable(v).clique; c != kRoot; c = cliques_[c].parent) {
      char& on_path = on_path_[static_cast<std::size_t>(c)];
      const bool known = on_path != 0;
      on_path = 1;
      if (!known) stack_.push_back(c);
      if (known) break;
    }
  }
  for (const int c : stack_) {
    const int parent = cliques_[c].parent;
    if (parent != kRoot) ++pending_[static_cast<std::size_t>(parent)];
  }
  for (const int c : stack_) {
    if (pending_[static_cast<std::size_t>(c)] == 0) path_.push_back(c);
  }
  for (std::size_t i = 0; i < path_.size(); ++i) {
    const int parent = cliques_[path_[i]].parent;
    if (parent != kRoot && --pending_[static_cast<std::size_t>(parent)] == 0) {
      path_.push_back(parent);
    }
  }
  for (const int c : path_) on_path_[static_cast<std::size_t>(c)] = 0;
}

/// right := L^-1 right for the clique's columns.
void CliqueTree::forward(const CliqueRecord& clique) {
  const Eigen::Map<const Eigen::MatrixXd> panel = panel_of(clique);
  const Eigen::Index f = clique.pivots;
  const Eigen::Index s = clique.size - 1 - f;
  const Eigen::Index first = offset_[static_cast<std::size_t>(clique.rows[0])];
  auto own = right_.middleRows(first, f);
  panel.topLeftCorner(f, f).triangularView<Eigen::Lower>().solveInPlace(own);
  if (s == 0) return;
  work_.noalias() = panel.block(f, 0, s, f) * own;
  Eigen::Index row = 0;
  for (int i = clique.frontal_count; i < clique.row_count; ++i) {
    const int size = dimension(graph_.variable(clique.rows[i]).type);
    right_.middleRows(offset_[static_cast<std::size_t>(clique.rows[i])], size) -=
        work_.middleRows(row, size);
    row += size;
  }
}

std::optional<Eigen::MatrixXd> CliqueTree::joint_covariance(std::span<const int> variables) {
  Eigen::Index columns = 0;
  for (const int v : variables) {
    if (graph_.variable(v).clique == graph::kNone) return std::nullopt;
    columns += dimension(graph_.variable(v).type);
  }
  collect_paths(variables);
  offset_.resize(static_cast<std::size_t>(graph_.variable_capacity()));
  int rows = 0;
  for (const int c : path_) {
    const CliqueRecord& clique = cliques_[c];
    if (clique.left_out > 0) return std::nullopt;
    for (int i = 0; i < clique.frontal_count; ++i) {
      offset_[static_cast<std::size_t>(clique.rows[i])] = rows;
      rows += dimension(graph_.variable(clique.rows[i]).type);
    }
  }
  right_.setZero(rows, columns);
  Eigen::Index column = 0;
  for (const int v : variables) {
    const int size = dimension(graph_.variable(v).type);
    const int row = offset_[static_cast<std::size_t>(v)];
    for (int k = 0; k < size; ++k) right_(row + k, column++) = 1.0;
  }
  for (const int c : path_) forward(cliques_[c]);
  // E' (L L')^-1 E = W' W with W = L^-1 E: half the work, and symmetric as it comes.
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(columns, columns);
  result.selfadjointView<Eigen::Lower>().rankUpdate(right_.transpose());
  return Eigen::MatrixXd(result.selfadjointView<Eigen::Lower>());
}

}  // namespace understory::factor_graph::bayes_tree
