// Variables and factors with their linearisations: the data of the solvers.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/factor_graph/graph/factor.hpp"
#include "common/factor_graph/storage/block_pool.hpp"
#include "common/factor_graph/storage/journaled_table.hpp"

namespace understory::factor_graph::graph {

/// End of a list, or "no number".
constexpr int kNone = -1;

/// A loop over many factors prefetches the numbers of the factor this many places ahead, and the
/// record of the one twice as far ahead.
constexpr std::size_t kFetchAhead = 8;

/// A variable with its estimate. The incremental smoother owns the fields marked (smoother).
struct VariableRecord {
  VariableType type = VariableType::kPose2;
  bool in_use = false;          ///< False after its removal.
  int clique = kNone;           ///< Clique that eliminates it (smoother).
  int first_incidence = kNone;  ///< First entry of the list of its factors.
  int degree = 0;               ///< Length of that list.
  Value base{};                 ///< Base of its chart; `delta` is relative to it.
  Value value{};                ///< The estimate: base moved by delta.
  Delta delta{};                ///< The estimate in its chart.
  /// Root of the largest information of one factor on the translation [1/m] and on the rotation
  /// [1/rad]. Pivots and moves are compared with it.
  std::array<double, 2> scale{};
  Delta judged{};        ///< `delta` at the last comparison of its factors (smoother).
  double rotated = 0.0;  ///< Largest Deviation::rotated of its factors then [rad] (smoother).
  /// One of its factors is nonlinear in more than rigid motions (a bearing, a robust loss, a
  /// user-defined one): any move can matter.
  bool is_curved = false;
};

/// One variable of one factor, in the variable's list.
struct IncidenceRecord {
  int factor = kNone;
  int variable = kNone;
  int next = kNone;  ///< Next entry in the variable's list.
  int previous = kNone;
};

/// A factor with its linearisation. Fields that every update reads are in the first cache line: an
/// update visits thousands of records and waits for each line.
struct alignas(64) FactorRecord {
  FactorKind kind = FactorKind::kPriorPose2;
  RobustKernel kernel = RobustKernel::kNone;
  bool in_use = false;                  ///< False after its removal.
  bool is_pending = false;              ///< It waits to be linearised again (smoother).
  int rows = 0;                         ///< Rows of the residual.
  int columns = 0;                      ///< Columns of the Jacobian.
  int variable_count = 0;               ///< Number of variables.
  std::array<int, 2> few_incidences{};  ///< Incidences of up to two variables.
  double* linear = nullptr;             ///< See FactorGraph::linearise().
  double* data = nullptr;               ///< Measurement, then the root of the information.
  int* many_links = nullptr;            ///< Variables, then incidences, if there are more than two.
  int measurement_size = 0;             ///< Length of the measurement in `data`.
  int data_size = 0;                    ///< Length of `data`.
  double loss_width = 1.0;              ///< See Loss.
  std::uint64_t linear_epoch = 0;       ///< Journal epoch in which `linear` was allocated.
  int user = kNone;                     ///< Number of the user-defined factor.

  /// The loss given to add().
  Loss loss() const { return {kernel, loss_width}; }
};

/// Deviation of a factor from its linearisation.
struct Deviation {
  /// Deviation of the residual, and of its derivative times the residual [sigmas].
  double residual = 0.0;
  double rotated = 0.0;     ///< Rotation of its frame since the linearisation [rad].
  double loss = 0.0;        ///< Loss of the factor.
  double linearised = 0.0;  ///< The same by the linearisation, up to a constant.
  double left_out = 0.0;    ///< Part of the squared residual missing in the linearisation.
};

/// Variables, factors and their linearisations, with undo to the last commit(). The cost of a
/// change depends only on the changed part. Not thread-safe, not even for reading: evaluation
/// shares scratch memory.
///
/// More than 20 functions because it is a container: most are overloads and accessors.
class FactorGraph {
 public:
  /// An empty graph.
  FactorGraph();

  /// Adds a pose in the plane.
  VariableId add(const geometry::SE2& initial) {
    return add(VariableType::kPose2, value_of(initial));
  }
  /// Adds a pose in space.
  VariableId add(const Pose3& initial) { return add(VariableType::kPose3, value_of(initial)); }
  /// Adds a point in the plane [m].
  VariableId add(const Eigen::Vector2d& initial) {
    return add(VariableType::kPoint2, value_of(initial));
  }
  /// Adds a point in space [m].
  VariableId add(const Eigen::Vector3d& initial) {
    return add(VariableType::kPoint3, value_of(initial));
  }
  /// Adds a scalar.
  VariableId add(double initial) { return add(VariableType::kScalar, value_of(initial)); }
  /// Adds a variable at this estimate. Throws std::invalid_argument where it is not finite.
  VariableId add(VariableType type, const Value& initial);

  /// Adds a measurement, linearised at the estimates. The information must be symmetric and
  /// positive semi-definite, everything finite. Throws std::invalid_argument where this or a
  /// variable's type is violated.
  FactorId add(const Factor& factor);
  /// Adds a condensed measurement; with the same conditions.
  FactorId add(const CondensedFactor& factor);
  /// Adds a user-defined factor of these variables, which the graph keeps alive.
  FactorId add(std::shared_ptr<const UserFactor> factor, std::span<const VariableId> variables);
  /// Adds e = J (x - x_0) - b at the present estimates x_0, rows of J and b whitened; see kLinear.
  FactorId add_linear(std::span<const VariableId> variables, const Eigen::MatrixXd& jacobian,
                      const Eigen::VectorXd& right);
  /// Removes a factor. Throws std::invalid_argument where there is none.
  void remove(FactorId id);
  /// Removes a variable without factors. Throws std::invalid_argument where it has some.
  void remove(VariableId id);

  /// True where the graph has this variable.
  bool contains(VariableId id) const;
  /// True where the graph has this factor.
  bool contains(FactorId id) const;
  /// Upper bound of all variables' numbers.
  int variable_capacity() const { return variables_.size(); }
  /// Upper bound of all factors' numbers.
  int factor_capacity() const { return factors_.size(); }
  /// Type of a variable.
  VariableType type(VariableId id) const { return variables_[index(id)].type; }
  /// Estimate of a variable.
  const Value& value(VariableId id) const { return variables_[index(id)].value; }
  /// Kind of a factor.
  FactorKind kind(FactorId id) const { return factors_[index(id)].kind; }
  /// Numbers of a factor's variables, in its order. Precondition: the graph has the factor.
  std::span<const int> variables_of(int factor) const {
    const std::array<int, 2>& few = variables_of_[static_cast<std::size_t>(factor)];
    if (few[0] == kNone) return many_variables_of(factor);
    return {few.data(), few[1] == kNone ? std::size_t{1} : std::size_t{2}};
  }
  /// Appends the factors of any variable for which `is_wanted` holds. O(factor_capacity()): for
  /// many variables this is faster than following their lists, because it reads eight bytes per
  /// factor in memory order.
  template <typename IsWanted>
  void list_factors(const IsWanted& is_wanted, std::vector<int>& found) const {
    for (int f = 0; f < factor_capacity(); ++f) {
      const std::array<int, 2>& few = variables_of_[static_cast<std::size_t>(f)];
      const bool is_found = few[0] == kNone
                                ? std::ranges::any_of(many_variables_of(f), is_wanted)
                                : is_wanted(few[0]) || (few[1] != kNone && is_wanted(few[1]));
      if (is_found) found.push_back(f);
    }
  }
  /// The measurement, see FactorKind.
  std::span<const double> measurement(FactorId id) const;
  /// The information as it was given, up to rounding. Not of kLinear and kUser.
  Eigen::MatrixXd information(FactorId id) const;
  /// The factor's loss.
  Loss loss(FactorId id) const { return factors_[index(id)].loss(); }

  /// Loss of one factor at the estimate.
  double chi2(FactorId id) const;
  /// Sum of all factors' losses at the estimate. O(factors).
  double chi2() const;

  /// Linearises at the estimate. `linear` then is [J (rows x columns, column-major) | b (rows) |
  /// four numbers for deviation()], whitened and weighted: cost = |J delta - b|^2.
  void linearise(int factor);
  /// Deviation of the factor at the estimate from its linearisation.
  Deviation deviation(int factor) const;
  /// Bound on the growth of the deviation of a factor of this variable, from its moves since the
  /// last comparison [sigmas]. Infinite = no bound.
  double unjudged_deviation(int variable) const;
  /// Moves the variable in its chart to `delta`.
  void move(int variable, const double* delta);
  /// Makes the estimate the base of the chart. Its factors must be linearised again.
  void rebase(int variable);
  /// Sets an estimate, which also becomes the base.
  void set_value(int variable, const Value& value);
  /// Gives a variable without factors a new estimate, like a new variable. Throws
  /// std::invalid_argument where it has factors, or where the estimate is not finite.
  void restart(int variable, const Value& initial);
  /// Sets a variable's scale from its present factors, after far stronger ones were removed. O(its
  /// factors).
  void renew_scale(int variable);

  /// Prefetches a factor's record into the processor's cache: the factors of a list are spread over
  /// memory, and waiting for each takes longer than its computation.
  void fetch_record(int factor) const { __builtin_prefetch(&factors_[factor]); }
  /// The same for its linearisation, after the record has arrived.
  void fetch_linear(int factor) const {
    __builtin_prefetch(factors_[factor].linear);
    __builtin_prefetch(factors_[factor].linear + 8);
  }
  /// The same for all its numbers.
  void fetch_numbers(int factor) const {
    fetch_linear(factor);
    __builtin_prefetch(factors_[factor].data);
  }

  /// A variable by number.
  const VariableRecord& variable(int id) const { return variables_[id]; }
  /// A factor by number.
  const FactorRecord& factor(int id) const { return factors_[id]; }
  /// An incidence by number.
  const IncidenceRecord& incidence(int id) const { return incidences_[id]; }
  /// A variable for change; journaled.
  VariableRecord& edit_variable(int id) { return variables_.edit(id); }
  /// A factor for change; journaled.
  FactorRecord& edit_factor(int id) { return factors_.edit(id); }

  /// Makes all changes final.
  void commit();
  /// Restores the state of the last commit(), exactly; at the cost of the changes.
  void rollback();
  /// Factors added since the last commit().
  const std::vector<int>& added_factors() const { return factors_.added(); }
  /// Memory taken from the system for measurements and linearisations [bytes].
  std::size_t bytes() const { return pool_.bytes(); }

 private:
  std::span<const int> many_variables_of(int factor) const {
    const FactorRecord& record = factors_[factor];
    if (!record.in_use || record.many_links == nullptr) return {};
    return {record.many_links, static_cast<std::size_t>(record.variable_count)};
  }
  int link(FactorKind kind, const Loss& loss, std::span<const VariableId> variables);
  void mark_curved(int factor);
  void check_types(FactorKind kind, std::span<const VariableId> variables) const;
  void store_data(int factor, std::span<const double> measurement,
                  const Eigen::Ref<const Eigen::MatrixXd>& information);
  std::span<const int> incidences_of(int factor) const;
  Deviation deviation_of_point2(const FactorRecord& factor, std::span<const int> names) const;
  void linearise_point2(const FactorRecord& factor, std::span<const int> names);
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
  /// The variables of each factor with at most two; kNone = no second one; kNone, kNone for larger
  /// factors.
  std::vector<std::array<int, 2>> variables_of_;
  struct Removed {
    int factor;
    std::array<int, 2> few;
  };
  std::vector<Removed> removed_;  ///< Removed since the last commit.
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
