// Taking variables out of a graph without losing their information.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

/// Directions with less information than this part of the largest are rounding.
constexpr double kRounding = 1e-14;

struct Neighbourhood {
  std::vector<int> variables;  ///< Those that go, then their neighbours.
  std::vector<int> starts;     ///< First column of each.
  std::vector<int> factors;
  int gone_columns = 0;
  int columns = 0;
};

int place(const Neighbourhood& all, int variable) {
  const auto found = std::find(all.variables.begin(), all.variables.end(), variable);
  return found == all.variables.end() ? graph::kNone
                                      : static_cast<int>(found - all.variables.begin());
}

Neighbourhood neighbourhood_of(const graph::FactorGraph& graph,
                               std::span<const graph::VariableId> ids) {
  Neighbourhood all;
  for (const graph::VariableId id : ids) {
    all.variables.push_back(index(id));
    all.gone_columns += dimension(graph.type(id));
  }
  for (const graph::VariableId id : ids) {
    for (int i = graph.variable(index(id)).first_incidence; i != graph::kNone;
         i = graph.incidence(i).next) {
      all.factors.push_back(graph.incidence(i).factor);
    }
  }
  std::sort(all.factors.begin(), all.factors.end());
  all.factors.erase(std::unique(all.factors.begin(), all.factors.end()), all.factors.end());
  for (const int f : all.factors) {
    for (const int v : graph.variables_of(f)) {
      if (place(all, v) == graph::kNone) all.variables.push_back(v);
    }
  }
  for (const int v : all.variables) {
    all.starts.push_back(all.columns);
    all.columns += dimension(graph.variable(v).type);
  }
  return all;
}

/// [H g; g' c] of the factors about the present estimates (not the charts' bases).
Eigen::MatrixXd information_of(graph::FactorGraph& graph, const Neighbourhood& all) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(all.columns + 1, all.columns + 1);
  for (const int f : all.factors) {
    graph.linearise(f);
    const graph::FactorRecord& factor = graph.factor(f);
    const Eigen::Map<const Eigen::MatrixXd> jacobian(factor.linear, factor.rows,
                                                     factor.columns + 1);
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(factor.rows, all.columns + 1);
    spread.rightCols(1) = jacobian.rightCols(1);

    int column = 0;
    for (const int v : graph.variables_of(f)) {
      const graph::VariableRecord& variable = graph.variable(v);
      const int size = dimension(variable.type);
      const auto own = jacobian.middleCols(column, size);
      spread.middleCols(all.starts[static_cast<std::size_t>(place(all, v))], size) = own;
      // About the estimate: what the present delta explains is taken out.
      spread.rightCols(1) -= own * Eigen::Map<const Eigen::VectorXd>(variable.delta.data(), size);
      column += size;
    }

    sum += spread.transpose() * spread;
  }
  return sum;
}

}  // namespace

bool IncrementalSmoother::marginalise(std::span<const graph::VariableId> ids) {
  begin_change();
  for (const graph::VariableId id : ids) {
    if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such variable");
  }

  const Neighbourhood all = neighbourhood_of(graph_, ids);
  // A pose's chart rotates with it: the linear factor counts from the present estimates.
  for (const int v : all.variables) {
    if (graph_.variable(v).type == graph::VariableType::kPose3) relinearisation_.rebase(v);
  }
  relinearisation_.run();

  // Schur complement on the neighbours.
  const Eigen::MatrixXd sum = information_of(graph_, all);
  const Eigen::Index gone = all.gone_columns;
  const Eigen::Index kept = all.columns - gone;
  const Eigen::LLT<Eigen::MatrixXd> cholesky(sum.topLeftCorner(gone, gone));
  if (gone > 0 && cholesky.info() != Eigen::Success) {
    // The factors stay, and are linearised otherwise than the tree has them.
    for (const int f : all.factors) tree_.mark_numbers(f);
    return false;
  }
  const Eigen::MatrixXd cross = sum.block(gone, 0, kept + 1, gone);
  const Eigen::MatrixXd rest =
      sum.bottomRightCorner(kept + 1, kept + 1) - cross * cholesky.solve(cross.transpose());

  for (const graph::VariableId id : ids) remove(id);
  if (kept == 0) return true;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(rest.topLeftCorner(kept, kept));
  const double least = kRounding * std::max(eigen.eigenvalues().maxCoeff(), 0.0);
  const auto rank = (eigen.eigenvalues().array() > least).count();
  if (rank == 0) return true;

  // Its root: rows of the linear factor, whitened.
  const Eigen::VectorXd roots = eigen.eigenvalues().tail(rank).cwiseSqrt();
  const auto vectors = eigen.eigenvectors().rightCols(rank);
  const Eigen::MatrixXd jacobian = roots.asDiagonal() * vectors.transpose();
  const Eigen::VectorXd right =
      roots.cwiseInverse().asDiagonal() * (vectors.transpose() * rest.topRightCorner(kept, 1));

  std::vector<graph::VariableId> neighbours;
  for (std::size_t i = ids.size(); i < all.variables.size(); ++i) {
    neighbours.push_back(graph::VariableId(all.variables[i]));
  }
  keep(graph_.add_linear(neighbours, jacobian, right));
  return true;
}

}  // namespace understory::factor_graph::bayes_tree
