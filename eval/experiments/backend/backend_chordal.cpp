// The chordal initialisation of a batch solver.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <vector>

#include "eval/experiments/backend/backend_batch.hpp"

namespace understory::eval::experiments::backend {
namespace {

using factor_graph::graph::FactorGraph;
using factor_graph::graph::FactorId;
using factor_graph::graph::FactorKind;
using factor_graph::graph::VariableId;
using factor_graph::graph::VariableType;

/// One measured tie between variables a and b.
struct Tie {
  int a = 0, b = 0;
  bool has_rotation = false;
  Eigen::MatrixXd rotation;     ///< Of b in a.
  Eigen::VectorXd translation;  ///< Of b in a [m].
  double per_rad2 = 0.0;        ///< Mean information of the rotation.
  double per_m2 = 0.0;          ///< And of the translation.
};

/// Sum over rows of w |x_b - A x_a - c|^2, with the first variable's block known.
class Chain {
 public:
  Chain(int variables, int size, int columns)
      : size_(size),
        matrix_(Eigen::Index{variables} * size, Eigen::Index{variables} * size),
        right_(Eigen::MatrixXd::Zero(matrix_.rows(), columns)) {}

  void fix(int variable, const Eigen::MatrixXd& value) {
    constexpr double kFirm = 1e9;
    const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(size_, size_);
    add_block(variable, variable, kFirm * unit);
    right_.middleRows(Eigen::Index{variable} * size_, size_) += kFirm * value;
  }
  void tie(int a, int b, const Eigen::MatrixXd& by, const Eigen::MatrixXd& shift, double weight) {
    add_block(a, a, weight * by.transpose() * by);
    add_block(b, b, weight * Eigen::MatrixXd::Identity(size_, size_));
    add_block(a, b, -weight * by.transpose());
    add_block(b, a, -weight * by);
    right_.middleRows(Eigen::Index{a} * size_, size_) -= weight * by.transpose() * shift;
    right_.middleRows(Eigen::Index{b} * size_, size_) += weight * shift;
  }
  Eigen::MatrixXd solve() {
    matrix_.setFromTriplets(entries_.begin(), entries_.end());
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix_).solve(right_);
  }

 private:
  void add_block(int a, int b, const Eigen::MatrixXd& block) {
    for (int r = 0; r < size_; ++r) {
      for (int c = 0; c < size_; ++c) {
        entries_.emplace_back(a * size_ + r, b * size_ + c, block(r, c));
      }
    }
  }

  int size_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::MatrixXd right_;
};

std::optional<Tie> tie_of(const FactorGraph& graph, int f) {
  const std::span<const double> z = graph.measurement(FactorId(f));
  const std::span<const int> variables = graph.variables_of(f);
  const Eigen::MatrixXd information = graph.information(FactorId(f));
  Tie tie;
  tie.a = variables[0];
  tie.b = variables.back();

  switch (graph.kind(FactorId(f))) {
    case FactorKind::kRelativePose2:
      tie.rotation = Eigen::Rotation2Dd(z[2]).toRotationMatrix();
      tie.has_rotation = true;
      break;
    case FactorKind::kRelativePose3:
      tie.rotation = Eigen::Quaterniond(z[6], z[3], z[4], z[5]).toRotationMatrix();
      tie.has_rotation = true;
      break;
    case FactorKind::kPoint2:
    case FactorKind::kPoint3:
      break;
    default:
      return std::nullopt;
  }

  const VariableType type = graph.type(VariableId(tie.a));
  const Eigen::Index translations = type == VariableType::kPose2 ? 2 : 3;
  const auto rotations = information.rows() - translations;
  tie.translation = Eigen::Map<const Eigen::VectorXd>(z.data(), translations);
  tie.per_m2 = information.diagonal().head(translations).mean();
  if (tie.has_rotation) tie.per_rad2 = information.diagonal().tail(rotations).mean();
  return tie;
}

Eigen::MatrixXd nearest_rotation(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::MatrixXd u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.rightCols<1>() *= -1.0;
  return u * svd.matrixV().transpose();
}

/// Rotations of all variables, one below the other, transposed; of points anything.
Eigen::MatrixXd rotations_of(const FactorGraph& graph, const std::vector<Tie>& ties, int size) {
  // Rows of the rotations: row_b = row_a * rotation. They share one matrix.
  Chain chain(graph.variable_capacity(), size, size);
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(size, size);
  chain.fix(0, unit);
  const Eigen::MatrixXd nothing = Eigen::MatrixXd::Zero(size, size);
  for (int v = 1; v < graph.variable_capacity(); ++v) {
    const VariableType type = graph.type(VariableId(v));
    if (type == VariableType::kPoint2 || type == VariableType::kPoint3) chain.fix(v, unit);
  }
  for (const Tie& tie : ties) {
    if (tie.has_rotation) {
      chain.tie(tie.a, tie.b, tie.rotation.transpose(), nothing, tie.per_rad2);
    }
  }

  Eigen::MatrixXd rotations = chain.solve();
  for (Eigen::Index v = 0; v < rotations.rows(); v += size) {
    rotations.middleRows(v, size) = nearest_rotation(rotations.middleRows(v, size));
  }
  return rotations;
}

void set_value(FactorGraph& graph, int v, const Eigen::VectorXd& at, const Eigen::MatrixXd& turn) {
  switch (graph.type(VariableId(v))) {
    case VariableType::kPose2:
      return graph.set_value(v, factor_graph::graph::value_of(geometry::SE2(
                                    at[0], at[1], std::atan2(turn(1, 0), turn(0, 0)))));
    case VariableType::kPose3:
      return graph.set_value(
          v, value_of(factor_graph::graph::Pose3{at, Eigen::Quaterniond(Eigen::Matrix3d(turn))}));
    case VariableType::kPoint2:
      return graph.set_value(v, factor_graph::graph::value_of(Eigen::Vector2d(at)));
    case VariableType::kPoint3:
      return graph.set_value(v, factor_graph::graph::value_of(Eigen::Vector3d(at)));
    case VariableType::kScalar:
      return;
  }
}

}  // namespace

std::optional<double> solve_from_chordal(const FactorGraph& from) {
  FactorGraph graph = copy_of(from);
  std::vector<Tie> ties;
  for (int f = 0; f < graph.factor_capacity(); ++f) {
    if (graph.variables_of(f).size() < 2) continue;
    const std::optional<Tie> tie = tie_of(graph, f);
    if (!tie) return std::nullopt;
    ties.push_back(*tie);
  }

  // Rotations first, then positions in the world's axes.
  const int size = graph.type(VariableId(0)) == VariableType::kPose2 ? 2 : 3;
  const Eigen::MatrixXd rotations = rotations_of(graph, ties, size);
  const auto rotation = [&](int v) -> Eigen::MatrixXd {
    return rotations.middleRows(Eigen::Index{v} * size, size).transpose();
  };
  Chain chain(graph.variable_capacity(), 1, size);
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(1, 1);
  chain.fix(0, Eigen::MatrixXd::Zero(1, size));
  for (const Tie& tie : ties) {
    const Eigen::MatrixXd shift = (rotation(tie.a) * tie.translation).transpose();
    chain.tie(tie.a, tie.b, unit, shift, tie.per_m2);
  }

  const Eigen::MatrixXd positions = chain.solve();
  for (int v = 0; v < graph.variable_capacity(); ++v) {
    set_value(graph, v, positions.row(v).transpose(), rotation(v));
  }
  return solve_whole(graph).chi2;
}

}  // namespace understory::eval::experiments::backend
