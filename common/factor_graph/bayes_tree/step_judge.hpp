// How good a step is: factors against their linearisations.
#pragma once

#include <cstdint>
#include <vector>

#include "common/factor_graph/bayes_tree/bayes_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// What a step is held to.
struct StepLimits {
  double relinearise_above = 0.0;  ///< Deviation from which a factor is linearised again [sigmas].
  double loss = 0.0;               ///< Sum of squares that changes are compared with [sigmas^2].
  bool is_thorough = false;        ///< Every linearisation was fresh before the step.
  bool is_repeated = false;        ///< Not the first step of its update.
};

/// What became of a step.
struct StepVerdict {
  bool is_accepted = true;       ///< False: the step is taken back.
  bool is_shortened = false;     ///< Taken back or halved: the tree's solution was not reached.
  double largest_deviation = 0;  ///< Of a factor from its linearisation [sigmas].
};

/// Compares the factors of the variables that the tree's last solve moved with their
/// linearisations, and takes back or halves a step that makes the loss noticeably larger.
class StepJudge {
 public:
  /// Works on these two, which must outlive it.
  StepJudge(graph::FactorGraph& graph, const BayesTree& tree) : graph_(graph), tree_(tree) {}

  /// Judges the tree's last solve. Linearisations of different ages that do not fit together push
  /// large graphs to and fro without end: where the step made the loss noticeably larger, those
  /// noticeably old are to be made anew where it began; where there are none, it is halved.
  StepVerdict judge(const StepLimits& limits);
  /// Factors that the last judge() found too far from their linearisations.
  const std::vector<int>& stale() const { return stale_; }

 private:
  /// Sums over the judged factors.
  struct Losses {
    double loss = 0.0;
    double linearised = 0.0;  ///< As the linearisations have it.
    double left_out = 0.0;    ///< By them, at the end of the step.
  };

  void list_judged(double unless_below);
  bool is_judged(int variable) const {
    return variable_at_[static_cast<std::size_t>(variable)] == count_;
  }
  double compare(double unless_below, double limit);
  void compare_factor(int factor, double limit);
  void keep_comparison();
  Losses go_back(double limit);
  void move_changed(const std::vector<graph::Delta>& to);
  void go_half_the_distance();

  graph::FactorGraph& graph_;
  const BayesTree& tree_;
  std::vector<int> judged_variables_;
  std::vector<int> judged_;                 ///< Their factors.
  std::vector<int> stale_;                  ///< Of those, what has to be linearised again.
  std::vector<int> stale_before_;           ///< And what had to be before the step.
  std::vector<std::uint64_t> judged_at_;    ///< Per factor: number of the comparison.
  std::vector<double> factor_rotation_;     ///< And how far it had rotated then [rad].
  std::vector<std::uint64_t> variable_at_;  ///< Per variable: number of the comparison.
  std::vector<double> rotation_of_;         ///< And the largest of its factors' rotations [rad].
  Losses at_end_;
  double largest_deviation_ = 0.0;     ///< [sigmas]
  std::vector<graph::Delta> reached_;  ///< Of the changed variables.
  std::uint64_t count_ = 0;            ///< Comparisons.
};

}  // namespace understory::factor_graph::bayes_tree
