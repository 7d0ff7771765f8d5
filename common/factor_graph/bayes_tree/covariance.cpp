#include "common/factor_graph/bayes_tree/covariance.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

Eigen::Map<const Eigen::MatrixXd> panel_of(const CliqueRecord& clique) {
  return {clique.panel, clique.size, clique.pivots};
}

}  // namespace

void Covariance::collect_paths(std::span<const int> variables) {
  is_on_path_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);
  found_.clear();
  for (const int v : variables) {
    for (int c = graph_.variable(v).clique; c != CliqueTree::kRoot; c = cliques_[c].parent) {
      char& is_on_path = is_on_path_[static_cast<std::size_t>(c)];
      if (is_on_path != 0) break;
      is_on_path = 1;
      found_.push_back(c);
    }
  }
  for (const int c : found_) is_on_path_[static_cast<std::size_t>(c)] = 0;
}

/// Sorts children before parents.
void Covariance::sort_paths() {
  pending_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);
  path_.clear();
  for (const int c : found_) {
    const int parent = cliques_[c].parent;
    if (parent != CliqueTree::kRoot) ++pending_[static_cast<std::size_t>(parent)];
  }

  for (const int c : found_) {
    if (pending_[static_cast<std::size_t>(c)] == 0) path_.push_back(c);
  }
  for (std::size_t i = 0; i < path_.size(); ++i) {
    const int parent = cliques_[path_[i]].parent;
    if (parent != CliqueTree::kRoot && --pending_[static_cast<std::size_t>(parent)] == 0) {
      path_.push_back(parent);
    }
  }
}

/// Number of rows; none where a clique of the paths lacks information.
std::optional<int> Covariance::give_rows() {
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
  return rows;
}

/// Sets E: the columns of the identity for the variables.
void Covariance::set_right_side(std::span<const int> variables, Eigen::Index rows,
                                Eigen::Index columns) {
  right_.setZero(rows, columns);
  Eigen::Index column = 0;
  for (const int v : variables) {
    const int size = dimension(graph_.variable(v).type);
    const int row = offset_[static_cast<std::size_t>(v)];
    for (int k = 0; k < size; ++k) right_(row + k, column++) = 1.0;
  }
}

/// right := L^-1 right for the clique's columns.
void Covariance::forward(const CliqueRecord& clique) {
  const Eigen::Map<const Eigen::MatrixXd> panel = panel_of(clique);
  const Eigen::Index f = clique.pivots;
  const Eigen::Index s = clique.size - 1 - f;
  const Eigen::Index first = offset_[static_cast<std::size_t>(clique.rows[0])];

  auto own = right_.middleRows(first, f);
  panel.topLeftCorner(f, f).triangularView<Eigen::Lower>().solveInPlace(own);
  if (s == 0) return;

  separator_part_.noalias() = panel.block(f, 0, s, f) * own;
  Eigen::Index row = 0;
  for (int i = clique.frontal_count; i < clique.row_count; ++i) {
    const int size = dimension(graph_.variable(clique.rows[i]).type);
    right_.middleRows(offset_[static_cast<std::size_t>(clique.rows[i])], size) -=
        separator_part_.middleRows(row, size);
    row += size;
  }
}

std::optional<Eigen::MatrixXd> Covariance::joint(std::span<const int> variables) {
  Eigen::Index columns = 0;
  for (const int v : variables) {
    if (graph_.variable(v).clique == graph::kNone) return std::nullopt;
    columns += dimension(graph_.variable(v).type);
  }

  collect_paths(variables);
  sort_paths();
  const std::optional<int> rows = give_rows();
  if (!rows) return std::nullopt;

  set_right_side(variables, *rows, columns);
  for (const int c : path_) forward(cliques_[c]);

  // E' (L L')^-1 E = W' W with W = L^-1 E: half the work, and exactly symmetric.
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(columns, columns);
  result.selfadjointView<Eigen::Lower>().rankUpdate(right_.transpose());
  return Eigen::MatrixXd(result.selfadjointView<Eigen::Lower>());
}

}  // namespace understory::factor_graph::bayes_tree
