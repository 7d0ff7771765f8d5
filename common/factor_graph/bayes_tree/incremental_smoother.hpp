// The least-squares solution of a factor graph, updated at the cost of the changes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/factor_graph/bayes_tree/bayes_tree.hpp"
#include "common/factor_graph/bayes_tree/incremental_parameters.hpp"
#include "common/factor_graph/bayes_tree/relinearisation.hpp"
#include "common/factor_graph/bayes_tree/step_judge.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Result of an update. An update never throws because of measurements; see `undetermined`.
struct IncrementalUpdate {
  bool ok = true;  ///< False: variables are undetermined.
  /// Variables that the measurements do not determine; their estimates stay.
  std::vector<graph::VariableId> undetermined;
  std::string error;              ///< Message with their names.
  int iterations = 0;             ///< Steps of linearisation, elimination and solution.
  long relinearised_factors = 0;  ///< Factors linearised again.
  double flops = 0.0;             ///< Floating-point operations of the eliminations.
  double deviation = 0.0;   ///< Largest remaining one between factor and linearisation [sigmas].
  bool is_settled = false;  ///< See settle().
};

/// Incremental smoother. Variables and factors are added and removed at any time; update() brings
/// the estimates up to date. Wrong arguments throw std::invalid_argument.
///
/// Undo: rollback() restores the state at checkpoint() or, without one, before the changes of the
/// last update(): estimates, factors, structure and numbers are exactly the same. It costs what had
/// changed.
///
/// More than 20 functions because it is the facade of graph and tree: half of them are overloads
/// and accessors.
class IncrementalSmoother {
 public:
  explicit IncrementalSmoother(const IncrementalParameters& parameters = {});
  IncrementalSmoother(IncrementalSmoother&&) = delete;
  ~IncrementalSmoother() = default;

  /// Adds a variable at this estimate (SE2, Pose3, Vector2d, Vector3d or a scalar).
  template <typename Initial>
  graph::VariableId add_variable(const Initial& initial) {
    begin_change();
    return graph_.add(initial);
  }
  /// Gives a variable without factors a new estimate, like a new variable. Throws
  /// std::invalid_argument where it has a factor, or where the estimate is not finite.
  void restart(graph::VariableId id, const graph::Value& initial);
  /// Call it after a factor of a variable was removed that was far stronger than its remaining
  /// ones: much less information may then count as determining it.
  void renew_scale(graph::VariableId id) { begin_change(), graph_.renew_scale(index(id)); }
  /// Adds a measurement; see FactorGraph::add() for its requirements.
  graph::FactorId add(const graph::Factor& factor) {
    return begin_change(), keep(graph_.add(factor));
  }
  /// Adds a condensed measurement.
  graph::FactorId add(const graph::CondensedFactor& factor) {
    return begin_change(), keep(graph_.add(factor));
  }
  /// Adds a user-defined factor of these variables.
  graph::FactorId add(std::shared_ptr<const graph::UserFactor> factor,
                      std::span<const graph::VariableId> variables) {
    return begin_change(), keep(graph_.add(std::move(factor), variables));
  }
  /// Removes a factor.
  void remove(graph::FactorId id);
  /// Removes a variable with all its factors.
  void remove(graph::VariableId id);
  /// Takes variables out and leaves their information about their neighbours as one linear factor,
  /// linearised here. False (and nothing is removed) where the variables' own factors do not
  /// determine them.
  bool marginalise(std::span<const graph::VariableId> ids);

  /// Announces that the next changes affect this variable and its neighbours: these are eliminated
  /// last, whatever else changes meanwhile. Without this call, the variables of the new factors are
  /// eliminated last.
  void expect_changes_at(graph::VariableId id) { pending_.expected = index(id); }
  /// Applies the changes. Costs about one factorisation at most; the next updates do the remaining
  /// work.
  IncrementalUpdate update();
  /// Makes complete steps, each with linearisations from its start, until a step changes the loss
  /// by less than a fraction of 1e-5: then `is_settled`. Each step costs one factorisation,
  /// O(graph).
  IncrementalUpdate settle(int max_updates = 20);
  /// Orders and factorises the whole graph again, linearised at the estimates, and iterates.
  IncrementalUpdate update_everything();

  /// Saves the present state for rollback().
  void checkpoint();
  /// Restores the state of the checkpoint, see above.
  void rollback();

  /// Variables and factors with their estimates.
  const graph::FactorGraph& graph() const { return graph_; }
  /// Estimate of a pose in the plane [m, rad].
  geometry::SE2 pose2(graph::VariableId id) const { return graph::pose2_of(graph_.value(id)); }
  /// Estimate of a pose in space [m].
  graph::Pose3 pose3(graph::VariableId id) const { return graph::pose3_of(graph_.value(id)); }
  /// Estimate of a point in the plane [m].
  Eigen::Vector2d point2(graph::VariableId id) const { return graph::point2_of(graph_.value(id)); }
  /// Estimate of a point in space [m].
  Eigen::Vector3d point3(graph::VariableId id) const { return graph::point3_of(graph_.value(id)); }
  /// Variables that the last update moved, each once.
  std::span<const int> moved() const { return moved_; }

  /// Joint covariance in the order given: poses perturbed on the right, in their own frames [m,
  /// rad]. None where a variable has no factor or is not determined. Costs one solution along the
  /// paths to the root.
  std::optional<Eigen::MatrixXd> joint_covariance(std::span<const graph::VariableId> ids);
  /// Covariance of each variable alone, in the order given, poses as in joint_covariance(); empty
  /// (0 x 0) where a variable has no factor or one on its path to the root is not determined. Costs
  /// one elimination of these paths, whatever the number of variables on them.
  std::vector<Eigen::MatrixXd> covariances(std::span<const graph::VariableId> ids);

  /// The factorised graph.
  const BayesTree& tree() const { return tree_; }
  /// Memory taken from the system for measurements and numbers [bytes].
  std::size_t bytes() const { return graph_.bytes() + tree_.cliques().bytes(); }

 private:
  /// Input of the next update, besides graph, tree and Relinearisation.
  struct Pending {
    std::vector<int> fresh;       ///< Factors that are not in the tree yet.
    std::vector<int> doomed;      ///< Variables to be removed.
    int expected = graph::kNone;  ///< Variable of the next changes.
    bool solve_everything = false;
  };

  /// Squared residuals of all factors.
  struct Loss {
    double chi2 = 0.0;
    double rows = 1.0;  ///< Number of rows of the residuals.
  };

  void begin_change();
  void commit();
  graph::FactorId keep(graph::FactorId id);

  IncrementalUpdate run(std::optional<double> whole_loss);
  bool iterate(IncrementalUpdate& update, std::optional<double> whole_loss);
  void find_last();
  void eliminate(IncrementalUpdate& update);
  void collect_moved();
  void finish(IncrementalUpdate& update);
  IncrementalUpdate whole_step(const Loss& before);
  Loss loss() const;

  IncrementalParameters parameters_;
  graph::FactorGraph graph_;
  BayesTree tree_;
  Relinearisation relinearisation_;
  StepJudge judge_;
  Pending pending_;
  Pending saved_pending_;
  bool has_checkpoint_ = false;
  bool updated_ = false;  ///< Nothing was changed since the last update.

  std::vector<int> last_;  ///< Variables to be eliminated last; scratch.
  std::vector<int> moved_;
  std::vector<char> is_moved_;  ///< Per variable; zero between updates.
};

/// Name of a variable for messages: "pose 3", "point 7".
std::string name_of(const graph::FactorGraph& graph, graph::VariableId id);

}  // namespace understory::factor_graph::bayes_tree
