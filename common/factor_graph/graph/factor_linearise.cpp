// Linearisation of factors, and its deviation.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::graph {
namespace {

using Eigen::Map;
using Eigen::Matrix;
template <int rows, int columns>
using Block = Map<Matrix<double, rows, columns>>;

/// Calls f<rows, columns>() with the sizes known to the compiler where they are common.
template <typename F>
void with_sizes(int rows, int columns, F&& f) {
  switch (rows * 32 + columns) {
    case 3 * 32 + 6:
      return f.template operator()<3, 6>();
    case 3 * 32 + 7:
      return f.template operator()<3, 7>();
    case 2 * 32 + 5:
      return f.template operator()<2, 5>();
    case 6 * 32 + 12:
      return f.template operator()<6, 12>();
    case 3 * 32 + 9:
      return f.template operator()<3, 9>();
    case 3 * 32 + 3:
      return f.template operator()<3, 3>();
    default:
      return f.template operator()<Eigen::Dynamic, Eigen::Dynamic>();
  }
}

/// Transforms a Jacobian from a pose's own frame into its chart, by the right Jacobian of its
/// rotation.
void into_chart(const VariableRecord& variable, double* columns, int rows) {
  if (variable.type != VariableType::kPose3) return;
  const Map<const Eigen::Vector3d> vector(variable.delta.data() + 3);
  if (vector.isZero(0.0)) return;
  Map<Matrix<double, Eigen::Dynamic, 3>> rotation(columns + 3 * rows, rows, 3);
  rotation *= right_jacobian(vector);
}

/// The first variable's rotation in its chart [rad]: residuals rotate with it.
Eigen::Vector3d rotation_of(const VariableRecord& variable) {
  if (variable.type == VariableType::kPose2) return {variable.delta[2], 0.0, 0.0};
  if (variable.type == VariableType::kPose3) return Eigen::Vector3d(variable.delta.data() + 3);
  return Eigen::Vector3d::Zero();
}

void residual_of_chart(const Value& from, const VariableRecord& to, double* out, double* jacobian) {
  const int size = dimension(to.type);
  if (to.type != VariableType::kPose3) {
    for (int i = 0; i < size; ++i) {
      const auto at = static_cast<std::size_t>(i);
      out[i] = to.value[at] - from[at];
    }
    return;
  }

  const Pose3 a = pose3_of(from);
  const Pose3 b = pose3_of(to.value);
  const Eigen::Vector3d rotation = log_rotation(a.rotation.conjugate() * b.rotation);
  Map<Eigen::Vector3d>(out, 3) = b.translation - a.translation;
  Map<Eigen::Vector3d>(out + 3, 3) = rotation;
  if (jacobian != nullptr) {
    // Inverse of the right Jacobian: I + [v]x / 2 + ... as the Jacobian of Log.
    Map<Eigen::Matrix3d>(jacobian, 3, 3) = right_jacobian(rotation).inverse();
  }
}

}  // namespace

void FactorGraph::linear_residual(const FactorRecord& factor, std::span<const int> variables,
                                  double* residual, double* jacobian) const {
  const double* base = factor.data;
  const double* j = factor.data + factor.measurement_size;
  Map<Eigen::VectorXd> e(residual, factor.rows);
  e = -Map<const Eigen::VectorXd>(j + static_cast<std::ptrdiff_t>(factor.rows) * factor.columns,
                                  factor.rows);
  int column = 0;
  for (const int name : variables) {
    const VariableRecord& variable = variables_[name];
    Value from;
    std::copy_n(base, from.size(), from.data());
    base += from.size();
    const int size = dimension(variable.type);
    Delta step{};
    Eigen::Matrix3d by_rotation;
    residual_of_chart(from, variable, step.data(), by_rotation.data());
    const auto first = static_cast<std::ptrdiff_t>(column) * factor.rows;
    const Map<const Eigen::MatrixXd> own(j + first, factor.rows, size);
    e.noalias() += own * Map<const Eigen::VectorXd>(step.data(), size);
    if (jacobian != nullptr) {
      Map<Eigen::MatrixXd> out(jacobian + first, factor.rows, size);
      out = own;
      if (variable.type == VariableType::kPose3) out.rightCols(3) = own.rightCols(3) * by_rotation;
    }
    column += size;
  }
}

void FactorGraph::whitened(const FactorRecord& factor, std::span<const int> variables,
                           double* residual, double* jacobian) const {
  if (factor.kind == FactorKind::kLinear) {
    linear_residual(factor, variables, residual, jacobian);
  } else if (factor.kind == FactorKind::kUser) {
    value_copies_.clear();
    for (const int name : variables) value_copies_.push_back(variables_[name].value);
    users_[static_cast<std::size_t>(factor.user)]->evaluate(value_copies_, residual, jacobian);
  } else {
    values_.clear();
    types_.clear();
    for (const int name : variables) {
      values_.push_back(&variables_[name].value);
      types_.push_back(variables_[name].type);
    }
    evaluate(factor.kind, factor.data, values_, types_, residual, jacobian);
    const double* root = factor.data + factor.measurement_size;
    with_sizes(factor.rows, factor.columns, [&]<int rows, int columns>() {
      const Map<const Matrix<double, rows, rows>> r(root, factor.rows, factor.rows);
      Map<Matrix<double, rows, 1>> e(residual, factor.rows);
      e = (r * e).eval();
      if (jacobian == nullptr) return;
      Block<rows, columns> j(jacobian, factor.rows, factor.columns);
      j = (r * j).eval();
    });
  }
  if (jacobian == nullptr) return;
  int column = 0;
  for (const int name : variables) {
    const VariableRecord& variable = variables_[name];
    into_chart(variable, jacobian + static_cast<std::ptrdiff_t>(column) * factor.rows, factor.rows);
    column += dimension(variable.type);
  }
}

double FactorGraph::chi2(FactorId id) const {
  const FactorRecord& record = factors_[index(id)];
  scratch_.resize(static_cast<std::size_t>(record.rows));
  whitened(record, variables_of(index(id)), scratch_.data(), nullptr);
  return evaluate(record.loss(),
                  Map<const Eigen::VectorXd>(scratch_.data(), record.rows).squaredNorm())
      .cost;
}

double FactorGraph::chi2() const {
  double sum = 0.0;
  for (int i = 0; i < factors_.size(); ++i) {
    if (factors_[i].in_use) sum += chi2(FactorId(i));
  }
  return sum;
}

void FactorGraph::keep_scales(const FactorRecord& factor, std::span<const int> variables) {
  const double* column = factor.linear;
  for (const int name : variables) {
    const VariableType type = variables_[name].type;
    const int size = dimension(type);
    const int translations = type == VariableType::kPose2 ? 2 : 3;
    std::array<double, 2> scale = variables_[name].scale;
    for (int i = 0; i < size; ++i, column += factor.rows) {
      const double information = Map<const Eigen::VectorXd>(column, factor.rows).norm();
      double& most = scale[i < translations ? 0 : 1];
      most = std::max(most, information);
    }
    if (scale != variables_[name].scale) variables_.edit(name).scale = scale;
  }
}

/// linearise() of an observation in the plane without a robust loss.
void FactorGraph::linearise_point2(const FactorRecord& record, std::span<const int> names) {
  const VariableRecord& pose = variables_[names[0]];
  const VariableRecord& point = variables_[names[1]];
  const Value* values[] = {&pose.value, &point.value};
  Eigen::Vector2d e;
  Matrix<double, 2, 5> by_both;
  evaluate(record.kind, record.data, values, {}, e.data(), by_both.data());

  const Map<const Eigen::Matrix2d> root(record.data + record.measurement_size);
  Map<Matrix<double, 2, 6>> linear(record.linear);
  linear.leftCols<5>().noalias() = root * by_both;
  linear.col(5) = linear.col(0) * pose.delta[0] + linear.col(1) * pose.delta[1] +
                  linear.col(2) * pose.delta[2] + linear.col(3) * point.delta[0] +
                  linear.col(4) * point.delta[1] - root * e;
  double* age = record.linear + linear.size();
  age[0] = 1.0;
  age[1] = pose.delta[2];
  age[2] = age[3] = 0.0;
  keep_scales(record, names);
}

void FactorGraph::linearise(int id) {
  FactorRecord& record = factors_.edit(id);
  const int rows = record.rows;
  const int columns = record.columns;
  if (record.linear == nullptr || record.linear_epoch != factors_.epoch()) {
    record.linear =
        pool_.take(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns + 1) + 4);
    record.linear_epoch = factors_.epoch();
  }

  if (record.kind == FactorKind::kPoint2 && record.kernel == RobustKernel::kNone)
    return linearise_point2(record, variables_of(id));

  const std::span<const int> variables = variables_of(id);
  double* j = record.linear;
  double* b = j + static_cast<std::ptrdiff_t>(rows) * columns;
  whitened(record, variables, b, j);
  double root_weight = 1.0;
  Map<Eigen::VectorXd> e(b, rows);
  const LossValue loss = evaluate(record.loss(), e.squaredNorm());
  Map<Eigen::MatrixXd> jacobian(j, rows, columns);
  if (record.kernel != RobustKernel::kNone) {
    root_weight = std::sqrt(loss.weight);
    e *= root_weight;
    jacobian *= root_weight;
  }

  // b = J delta - e
  e = -e;
  int column = 0;
  for (const int name : variables) {
    const VariableRecord& variable = variables_[name];
    const int size = dimension(variable.type);
    for (int i = 0; i < size; ++i, ++column) {
      e += variable.delta[static_cast<std::size_t>(i)] * jacobian.col(column);
    }
  }

  // Numbers for deviation().
  const Eigen::Vector3d rotation = rotation_of(variables_[variables[0]]);
  double* age = b + rows;
  age[0] = root_weight;
  std::copy_n(rotation.data(), 3, age + 1);
  keep_scales(record, variables);
}

void FactorGraph::copy_moves(std::span<const int> variables, double* to) const {
  for (const int name : variables) {
    const VariableRecord& variable = variables_[name];
    to = std::copy_n(variable.delta.data(), dimension(variable.type), to);
  }
}

/// deviation() of an observation in the plane without a robust loss: the case of nearly all factors
/// of a map.
Deviation FactorGraph::deviation_of_point2(const FactorRecord& record,
                                           std::span<const int> names) const {
  const VariableRecord& pose = variables_[names[0]];
  const VariableRecord& point = variables_[names[1]];
  const double* z = record.data;
  const Map<const Eigen::Matrix2d> root(z + record.measurement_size);
  const Eigen::Vector2d apart(point.value[0] - pose.value[0], point.value[1] - pose.value[1]);
  const double c = pose.value[3];
  const double s = pose.value[4];
  const Eigen::Vector2d e = root * Eigen::Vector2d(c * apart.x() + s * apart.y() - z[0],
                                                   -s * apart.x() + c * apart.y() - z[1]);

  const Map<const Matrix<double, 2, 6>> j(record.linear);
  const Eigen::Vector2d linear = j.col(0) * pose.delta[0] + j.col(1) * pose.delta[1] +
                                 j.col(2) * pose.delta[2] + j.col(3) * point.delta[0] +
                                 j.col(4) * point.delta[1] - j.col(5);
  const double* age = record.linear + 12;
  const double squared = e.squaredNorm();
  const double predicted = linear.squaredNorm();
  const double rotated = std::abs(pose.delta[2] - age[1]);
  return {std::sqrt((e - linear).squaredNorm() + squared * rotated * rotated), rotated, squared,
          predicted, squared - predicted};
}

Deviation FactorGraph::deviation(int id) const {
  const FactorRecord& record = factors_[id];
  if (record.kind == FactorKind::kPoint2 && record.kernel == RobustKernel::kNone)
    return deviation_of_point2(record, variables_of(id));
  const std::span<const int> variables = variables_of(id);
  const int numbers = 2 * record.rows + record.columns;
  scratch_.resize(static_cast<std::size_t>(numbers));
  double* residual = scratch_.data();
  whitened(record, variables, residual, nullptr);
  double* moves = residual + 2 * record.rows;
  copy_moves(variables, moves);

  // Residual, and residual by the linearisation.
  const double* age =
      record.linear + static_cast<std::ptrdiff_t>(record.rows) * (record.columns + 1);
  double squared = 0.0;
  double predicted = 0.0;
  double off2 = 0.0;
  with_sizes(record.rows, record.columns, [&]<int rows, int columns>() {
    const Map<const Matrix<double, rows, 1>> e(residual, record.rows);
    const Map<const Matrix<double, rows, columns>> j(record.linear, record.rows, record.columns);
    const Map<const Matrix<double, rows, 1>> b(j.data() + j.size(), record.rows);
    const Map<const Matrix<double, columns, 1>> delta(moves, record.columns);
    Map<Matrix<double, rows, 1>> linear(residual + record.rows, record.rows);
    linear.noalias() = j * delta;
    linear -= b;
    squared = e.squaredNorm();
    predicted = linear.squaredNorm();
    off2 = (age[0] * e - linear).squaredNorm();
  });

  double reweighted = 0.0;
  double loss = squared;
  if (record.kernel != RobustKernel::kNone) {
    const LossValue value = evaluate(record.loss(), squared);
    reweighted = std::sqrt(value.weight) - age[0];
    loss = value.cost;
  }

  const Eigen::Vector3d rotation_before(age[1], age[2], age[3]);
  const double rotated = (rotation_of(variables_[variables[0]]) - rotation_before).norm();
  const double weight2 = age[0] * age[0];
  return {std::sqrt(off2 + squared * (rotated * rotated * weight2 + reweighted * reweighted)),
          rotated, loss, predicted, squared * weight2 - predicted};
}

double FactorGraph::unjudged_deviation(int id) const {
  const VariableRecord& variable = variables_[id];
  if (variable.is_curved) return std::numeric_limits<double>::infinity();
  Delta d;
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = variable.delta[i] - variable.judged[i];

  double moved = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  double rotated = 0.0;
  if (variable.type == VariableType::kPose2) {
    moved = std::sqrt(d[0] * d[0] + d[1] * d[1]);
    rotated = std::abs(d[2]);
  } else if (variable.type == VariableType::kPose3) {
    rotated = std::sqrt(d[3] * d[3] + d[4] * d[4] + d[5] * d[5]);
  }

  // Second order in the moves; and the derivative rotates the residual, of some sigmas.
  return variable.scale[1] * rotated * (0.5 * rotated + variable.rotated) +
         variable.scale[0] * moved * (rotated + variable.rotated) + 2.0 * rotated;
}

void FactorGraph::move(int id, const double* delta) {
  VariableRecord& record = variables_.edit(id);
  std::copy_n(delta, dimension(record.type), record.delta.begin());
  record.value = moved(record.type, record.base, delta);
}

void FactorGraph::rebase(int id) {
  VariableRecord& record = variables_.edit(id);
  record.base = record.value;
  record.delta = record.judged = Delta{};
}

void FactorGraph::set_value(int id, const Value& value) {
  VariableRecord& record = variables_.edit(id);
  record.base = record.value = value;
  record.delta = record.judged = Delta{};
}

}  // namespace understory::factor_graph::graph
