// The least-squares solution of a factor graph, kept up to date at the cost of what changed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Limits are in parts of the residuals' own root mean square (`unit`), which the thorough updates
/// measure: information that is stated a thousand times too small needs no less precision.
struct IncrementalParameters {
  /// A variable that would move by less of its conditional standard deviation stays.
  double least_move = 0.2;
  /// What lies below changes that are all smaller than so many times least_move waits for its turn;
  /// so many cliques have theirs in an update. 1: nothing waits.
  double wait_below = 1.0;
  int turns = 100;
  /// A factor whose residual is further than this from what its linearisation says is linearised
  /// again with the next update. Of a relative pose in the plane; in space by the root of its rows
  /// more.
  double relinearise_above = 0.5;
  /// An update goes on (up to max_iterations) while a factor is this far from its linearisation
  /// [sigmas].
  double iterate_above = 1.0;
  int max_iterations = 5;
  /// Every so many updates, one looks at all factors, with limits of its own: what is below the
  /// usual ones adds up. What it finds is made up for over the updates that follow. 0: never.
  int thorough_every = 200;
  double thorough_move = 0.01;
  double thorough_relinearise_above = 0.05;
  double first_unit = 0.1;  ///< Until it is measured [sigmas].
};

/// What an update found. Never throws for what was measured; see `undetermined`.
struct IncrementalUpdate {
  bool ok = true;
  std::vector<graph::VariableId> undetermined;  ///< By the measurements; left where they are.
  std::string error;                            ///< Names them.
  int iterations = 0;
  long eliminated_variables = 0;
  long refreshed_cliques = 0;
  long relinearised_factors = 0;
  long moved_variables = 0;
  double flops = 0.0;
  double deviation = 0.0;  ///< Largest one left [sigmas].
};

/// Incremental smoother. Variables and factors are added and removed at any time; update() brings
/// the estimates up to date.
///
/// Undo: rollback() takes everything back that happened since checkpoint(), or, where there was
/// none, since before the changes that the last update() took in: estimates, factors, structure and
/// numbers are exactly those of then. It costs what had changed.
class IncrementalSmoother {
 public:
  explicit IncrementalSmoother(const IncrementalParameters& parameters = {});
  IncrementalSmoother(IncrementalSmoother&&) = delete;
  ~IncrementalSmoother() = default;

  template <typename Initial>
  graph::VariableId add_variable(const Initial& initial) {
    begin_change();
    return graph_.add(initial);
  }
  graph::FactorId add(const graph::Factor& factor) {
    return begin_change(), keep(graph_.add(factor));
  }
  graph::FactorId add(const graph::CondensedFactor& factor) {
    return begin_change(), keep(graph_.add(factor));
  }
  graph::FactorId add(std::shared_ptr<const graph::UserFactor> factor,
                      std::span<const graph::VariableId> variables) {
    return begin_change(), keep(graph_.add(std::move(factor), variables));
  }
  void remove(graph::FactorId id);
  /// With all its factors.
  void remove(graph::VariableId id);
  /// Takes variables out and leaves what they tell about their neighbours, linearised here.
  /// False (and nothing is changed) where the variables' own factors do not determine them.
  bool marginalise(std::span<const graph::VariableId> ids);

  /// At most about one factorisation's work: what is left over is done by the next ones.
  IncrementalUpdate update();
  /// With the limits of the thorough ones, and to the end.
  IncrementalUpdate update_thoroughly();
  /// Thorough updates until nothing has to be linearised again.
  IncrementalUpdate settle(int max_updates = 20);
  /// Orders and factorises everything anew, linearised at the estimates, and iterates.
  IncrementalUpdate update_everything();

  void checkpoint();
  void rollback();

  const graph::FactorGraph& graph() const { return graph_; }
  geometry::SE2 pose2(graph::VariableId id) const { return graph::pose2_of(graph_.value(id)); }
  graph::Pose3 pose3(graph::VariableId id) const { return graph::pose3_of(graph_.value(id)); }
  Eigen::Vector2d point2(graph::VariableId id) const { return graph::point2_of(graph_.value(id)); }
  Eigen::Vector3d point3(graph::VariableId id) const { return graph::point3_of(graph_.value(id)); }
  /// Variables that the last update moved.
  std::span<const int> moved() const { return moved_; }

  /// Joint covariance in the order given: poses perturbed on the right, in their own frames. None
  /// where one has no factor or is not determined. Costs what the paths to the root cost.
  std::optional<Eigen::MatrixXd> joint_covariance(std::span<const graph::VariableId> ids);

  const CliqueTree& tree() const { return tree_; }
  std::size_t bytes() const { return graph_.bytes() + tree_.bytes(); }

 private:
  struct Pending {
    std::vector<int> fresh;   ///< Factors that the tree does not hold yet.
    std::vector<int> stale;   ///< Factors to be linearised again.
    std::vector<int> rebase;  ///< Variables far from their charts' bases.
    std::vector<int> sweep;   ///< Factors that wait for their part of a thorough update.
    int sweep_part = 0;       ///< So many of them with each update.
    std::vector<int> doomed;  ///< Variables to be removed.
    bool solve_everything = false;
    int since_thorough = 0;  ///< Updates.
    double chi2 = 0.0;       ///< When it was last summed up.
    double unit = 1.0;       ///< See IncrementalParameters [sigmas].
  };

  void begin_change();
  void commit();
  graph::FactorId keep(graph::FactorId id);
  long relinearise();
  bool iterate(IncrementalUpdate& update, bool thorough);

  /// Sums over the judged factors.
  struct Losses {
    double loss = 0.0;
    double linearised = 0.0;  ///< As the linearisations have it.
    double left_out = 0.0;    ///< By them, at the end of the step.
  };
  /// Part of the limit to deviations, that may grow unseen.
  static constexpr double kNegligible = 0.2;
  /// Limits are stated for relative poses in the plane; a residual in space is larger by its rows.
  static double part_of_rows(const graph::FactorRecord& factor);
  void judge_factor(int factor, double limit);
  double judge(double unless_below, double limit);
  void keep_judgement();
  Losses go_back(double limit);
  void move_changed(const std::vector<graph::Delta>& to);
  void go_half_the_way();
  bool accept_step(IncrementalUpdate& update, bool thorough);

  void finish(IncrementalUpdate& update);
  void measure_unit();
  std::vector<int> noticeably_old(double relinearise_above) const;
  void make_stale(int factor);
  bool has_curved_charts() const;
  void begin_sweep();
  void take_part_of_sweep();
  double usual_unit() const;
  void collect_moved();
  IncrementalUpdate run(bool thorough, double most_work);
  IncrementalUpdate run_thoroughly(double relinearise_above);

  IncrementalParameters parameters_;
  graph::FactorGraph graph_;
  CliqueTree tree_;
  Pending pending_;
  Pending saved_pending_;
  bool has_checkpoint_ = false;
  bool updated_ = false;

  std::vector<int> last_;
  std::vector<int> moved_;
  std::vector<std::uint64_t> moved_at_;

  // Of the last step.
  std::vector<int> judged_variables_;
  std::vector<int> judged_;               ///< Factors.
  std::vector<int> off_;                  ///< Of those, what has to be linearised again.
  std::vector<int> old_;                  ///< And what had to be before the step.
  std::vector<std::uint64_t> judged_at_;  ///< Per factor: number of the judgement.
  std::vector<double> factor_turned_;     ///< And how far it had turned then [rad].
  Losses at_end_;
  double largest_deviation_ = 0.0;
  std::vector<graph::Delta> reached_;
  std::uint64_t count_ = 0;
};

/// "pose 3", "point 7": for messages.
std::string name_of(const graph::FactorGraph& graph, graph::VariableId id);

}  // namespace understory::factor_graph::bayes_tree
