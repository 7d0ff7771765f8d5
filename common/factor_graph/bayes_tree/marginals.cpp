#include "common/factor_graph/bayes_tree/marginals.hpp"

namespace understory::factor_graph::bayes_tree {

/// Marks the variables, and the cliques on their paths to the root.
void Marginals::mark(std::span<const int> variables) {
  is_needed_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);
  is_wanted_.resize(static_cast<std::size_t>(graph_.variable_capacity()), 0);
  offset_.resize(static_cast<std::size_t>(graph_.variable_capacity()));
  needed_.clear();

  for (const int v : variables) {
    if (graph_.variable(v).clique == graph::kNone) continue;
    is_wanted_[static_cast<std::size_t>(v)] = 1;
    for (int c = graph_.variable(v).clique; c != CliqueTree::kRoot; c = cliques_[c].parent) {
      char& is_needed = is_needed_[static_cast<std::size_t>(c)];
      if (is_needed != 0) break;
      is_needed = 1;
      needed_.push_back(c);
    }
  }
}

/// With x_F = -L_F^-T L_S^T x_S + L_F^-T w, w of unit covariance: the clique's joint covariance
/// from that of its separator.
void Marginals::expand(const CliqueRecord& clique, const Eigen::MatrixXd& of_separator) {
  const Eigen::Map<const Eigen::MatrixXd> panel(clique.panel, clique.size, clique.pivots);
  const Eigen::Index f = clique.pivots;
  const Eigen::Index s = clique.size - 1 - f;

  inverse_.setIdentity(f, f);
  panel.topLeftCorner(f, f).triangularView<Eigen::Lower>().solveInPlace(inverse_);
  covariance_.resize(f + s, f + s);
  covariance_.topLeftCorner(f, f).noalias() = inverse_.transpose() * inverse_;
  if (s == 0) return;

  gain_.noalias() = -inverse_.transpose() * panel.block(f, 0, s, f).transpose();
  covariance_.topRightCorner(f, s).noalias() = gain_ * of_separator;
  covariance_.bottomLeftCorner(s, f) = covariance_.topRightCorner(f, s).transpose();
  covariance_.bottomRightCorner(s, s) = of_separator;
  covariance_.topLeftCorner(f, f).noalias() += covariance_.topRightCorner(f, s) * gain_.transpose();
}

void Marginals::report(const CliqueRecord& clique, const Visit& found) const {
  for (int i = 0; i < clique.frontal_count; ++i) {
    const int v = clique.rows[i];
    if (is_wanted_[static_cast<std::size_t>(v)] == 0) continue;
    const Eigen::Index at = offset_[static_cast<std::size_t>(v)];
    const Eigen::Index size = dimension(graph_.variable(v).type);
    found(v, covariance_.block(at, at, size, size));
  }
}

/// Gives each needed child the covariance of its separator.
void Marginals::hand_down(const CliqueRecord& clique) {
  for (int c = clique.first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    if (is_needed_[static_cast<std::size_t>(c)] == 0) continue;
    const CliqueRecord& child = cliques_[c];
    const std::span<const int> separator(child.rows + child.frontal_count,
                                         child.rows + child.row_count);

    Waiting next{c, Eigen::MatrixXd(child.size - 1 - child.pivots, child.size - 1 - child.pivots)};
    Eigen::Index row = 0;
    for (const int a : separator) {
      const Eigen::Index rows = dimension(graph_.variable(a).type);
      Eigen::Index column = 0;
      for (const int b : separator) {
        const Eigen::Index columns = dimension(graph_.variable(b).type);
        next.of_separator.block(row, column, rows, columns) =
            covariance_.block(offset_[static_cast<std::size_t>(a)],
                              offset_[static_cast<std::size_t>(b)], rows, columns);
        column += columns;
      }
      row += rows;
    }
    waiting_.push_back(std::move(next));
  }
}

bool Marginals::visit(std::span<const int> variables, const Visit& found) {
  mark(variables);
  waiting_.clear();
  for (const int c : needed_) {
    if (cliques_[c].parent == CliqueTree::kRoot) waiting_.push_back({c, {}});
  }

  bool is_determined = true;
  while (!waiting_.empty() && is_determined) {
    const Waiting next = std::move(waiting_.back());
    waiting_.pop_back();
    const CliqueRecord& clique = cliques_[next.clique];
    is_determined = clique.left_out == 0;
    if (!is_determined) break;

    int row = 0;
    for (int i = 0; i < clique.row_count; ++i) {
      offset_[static_cast<std::size_t>(clique.rows[i])] = row;
      row += dimension(graph_.variable(clique.rows[i]).type);
    }
    expand(clique, next.of_separator);
    report(clique, found);
    hand_down(clique);
  }

  for (const int c : needed_) is_needed_[static_cast<std::size_t>(c)] = 0;
  for (const int v : variables) is_wanted_[static_cast<std::size_t>(v)] = 0;
  return is_determined;
}

}  // namespace understory::factor_graph::bayes_tree
