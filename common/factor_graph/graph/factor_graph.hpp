// Variables and factors with their linearisations: what the solvers work on.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/factor_graph/graph/factor.hpp"
#include "common/factor_graph/storage/block_pool.hpp"
#include "common/factor_graph/storage/journaled_table.hpp"

namespace understory::factor_graph::graph {

constexpr int kNone = -1;

struct VariableRecord {
  VariableType type = VariableType::kPose2;
  bool in_use = false;
  int clique = kNone;           ///< Where it is eliminated; for the smoother.
  int first_incidence = kNone;  ///< List of its factors.
  int degree = 0;               ///< Length of that list.
  Value base{};                 ///< `delta` counts from here.
  Value value{};                ///< The estimate: base moved by delta.
  Delta delta{};
  /// Root of the largest information that one factor gives: of the translation [1/m], of the
  /// rotation [1/rad]. What pivots and moves are measured against.
  std::array<double, 2> scale{};
  /// For the smoother: `delta` when its factors were last compared with their linearisations, and
  /// how far the one of them that had turned furthest had turned [rad].
  Delta judged{};
  double turned = 0.0;
  /// A factor of its bends otherwise than rigid motions do (a bearing, a robust loss, a user's):
  /// any move can matter.
  bool is_curved = false;
};

struct IncidenceRecord {
  int factor = kNone;
  int variable = kNone;
  int next = kNone;  ///< In the variable's list.
  int previous = kNone;
};

struct FactorRecord {
  FactorKind kind = FactorKind::kPriorPose2;
  bool in_use = false;
  bool is_pending = false;  ///< Its linearisation is too old; for the smoother.
  Loss loss;
  int rows = 0;     ///< Of the residual.
  int columns = 0;  ///< Of the Jacobian.
  int variable_count = 0;
  std::array<int, 2> few_links[2] = {};  ///< Variables, incidences; of up to two.
  int* many_links = nullptr;             ///< The same where there are more.
  double* data = nullptr;                ///< Measurement, then the root of the information.
  int data_size = 0;
  int measurement_size = 0;
  double* linear = nullptr;  ///< See FactorGraph::linearise().
  std::uint64_t linear_epoch = 0;
  std::uint64_t made_at = 0;
  int user = kNone;
  int clique = kNone;  ///< Where it is assembled; for the smoother.
  int next = kNone;    ///< Next one there.
};

/// How far a factor is from its linearisation.
struct Deviation {
  double residual = 0.0;    ///< Of the residual, and of its derivative times the residual [sigmas].
  double turned = 0.0;      ///< Its frame since then [rad].
  double loss = 0.0;        ///< Of the factor, and
  double linearised = 0.0;  ///< as the linearisation has it, up to a constant.
  double left_out = 0.0;    ///< By the linearisation, of what the residual's square grew to.
};

/// Graph of variables and factors, with the way back to the last commit().
///
/// A factor is linearised at the estimate of the moment, each on its own; all linearisations count
/// in the charts of the variables, so they can be added up whatever their ages.
class FactorGraph {
 public:
  FactorGraph();

  VariableId add(const geometry::SE2& initial) {
    return add(VariableType::kPose2, value_of(initial));
  }
  VariableId add(const Pose3& initial) { return add(VariableType::kPose3, value_of(initial)); }
  VariableId add(const Eigen::Vector2d& initial) {
    return add(VariableType::kPoint2, value_of(initial));
  }
  VariableId add(const Eigen::Vector3d& initial) {
    return add(VariableType::kPoint3, value_of(initial));
  }
  VariableId add(double initial) { return add(VariableType::kScalar, value_of(initial)); }
  VariableId add(VariableType type, const Value& initial);

  /// The information must be symmetric and positive semi-definite, everything finite. Throws
  /// std::invalid_argument where that, or a variable's type, is not so.
  FactorId add(const Factor& factor);
  FactorId add(const CondensedFactor& factor);
  FactorId add(std::shared_ptr<const UserFactor> factor, std::span<const VariableId> variables);
  /// e = J (x - x_0) - b at the present estimates x_0, rows of J and b whitened; see kLinear.
  FactorId add_linear(std::span<const VariableId> variables, const Eigen::MatrixXd& jacobian,
                      const Eigen::VectorXd& right);
  void remove(FactorId id);
  /// Only without factors.
  void remove(VariableId id);

  bool contains(VariableId id) const;
  bool contains(FactorId id) const;
  int variable_capacity() const { return variables_.size(); }
  int factor_capacity() const { return factors_.size(); }
  VariableType type(VariableId id) const { return variables_[index(id)].type; }
  const Value& value(VariableId id) const { return variables_[index(id)].value; }
  FactorKind kind(FactorId id) const { return factors_[index(id)].kind; }
  std::span<const int> variables_of(int factor) const;
  std::span<const double> measurement(FactorId id) const;
  Eigen::MatrixXd information(FactorId id) const;
  Loss loss(FactorId id) const { return factors_[index(id)].loss; }

  /// Loss of one factor, or of all, at the estimate.
  double chi2(FactorId id) const;
  double chi2() const;

  /// Linearises at the estimate. `linear` then is [J (rows x columns, column-major) | b (rows) |
  /// four numbers to judge its age by], whitened and weighted: cost = |J delta - b|^2.
  void linearise(int factor);
  Deviation deviation(int factor) const;
  /// Bound on what the deviation of a factor of this variable grew by, from its moves since the
  /// factors were last looked at [sigmas]. Infinite where there is none.
  double unjudged_deviation(int variable) const;
  /// Moves the variable in its chart.
  void move(int variable, const double* delta);
  /// Makes the estimate the base of the chart. Its factors must be linearised again.
  void rebase(int variable);
  /// An estimate from elsewhere; becomes the base, too.
  void set_value(int variable, const Value& value);

  const VariableRecord& variable(int id) const { return variables_[id]; }
  const FactorRecord& factor(int id) const { return factors_[id]; }
  const IncidenceRecord& incidence(int id) const { return incidences_[id]; }
  VariableRecord& edit_variable(int id) { return variables_.edit(id); }
  FactorRecord& edit_factor(int id) { return factors_.edit(id); }

  void commit();
  void rollback();
  /// What the next commit() makes final.
  const std::vector<int>& added_factors() const { return factors_.added(); }
  std::size_t bytes() const { return pool_.bytes(); }

 private:
  int link(FactorKind kind, std::span<const VariableId> variables);
  void mark_curved(int factor);
  void check_types(FactorKind kind, std::span<const VariableId> variables) const;
  void store_data(int factor, std::span<const double> measurement,
                  const Eigen::Ref<const Eigen::MatrixXd>& information);
  std::span<const int> incidences_of(int factor) const;
  void copy_moves(std::span<const int> variables, double* to) const;
  void free_blocks(const FactorRecord& factor);
  /// Residual (and Jacobian) before the loss, whitened, in the charts.
  void whitened(const FactorRecord& factor, std::span<const int> variables, double* residual,
                double* jacobian) const;
  void linear_residual(const FactorRecord& factor, std::span<const int> variables, double* residual,
                       double* jacobian) const;
  void keep_scales(const FactorRecord& factor, std::span<const int> variables);

  storage::JournaledTable<VariableRecord> variables_;
  storage::JournaledTable<FactorRecord> factors_;
  storage::JournaledTable<IncidenceRecord> incidences_;
  storage::BlockPool<double> pool_;
  storage::BlockPool<int> links_;
  std::vector<std::shared_ptr<const UserFactor>> users_;
  std::vector<int> free_users_;
  mutable std::vector<double> scratch_;
  mutable std::vector<const Value*> values_;
  mutable std::vector<Value> value_copies_;
  mutable std::vector<VariableType> types_;
};

}  // namespace understory::factor_graph::graph
