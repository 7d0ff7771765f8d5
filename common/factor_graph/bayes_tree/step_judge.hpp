// Judges a step by comparing factors with their linearisations.
#pragma once

#include <cstdint>
#include <vector>

#include "common/factor_graph/bayes_tree/bayes_tree.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Limits of a step.
struct StepLimits {
  double relinearise_above = 0.0;  ///< Deviation from which a factor is linearised again [sigmas].
  double loss = 0.0;               ///< Reference sum of squares for changes [sigmas^2].
  bool is_thorough = false;        ///< Every linearisation was fresh before the step.
  bool is_repeated = false;        ///< Not the first step of its update.
};

/// The verdict on a step.
struct StepVerdict {
  bool is_accepted = true;       ///< False: the step is undone.
  bool is_shortened = false;     ///< Undone or halved: the tree's solution was not reached.
  double largest_deviation = 0;  ///< Largest deviation of a factor from its linearisation [sigmas].
};

/// Compares the factors of the variables that the tree's last solve moved with their
/// linearisations, and undoes or halves a step that makes the loss noticeably larger.
class StepJudge {
 public:
  /// Both references must outlive it.
  StepJudge(graph::FactorGraph& graph, const BayesTree& tree) : graph_(graph), tree_(tree) {}

  /// Judges the tree's last solve. Inconsistent linearisations of different ages can make large
  /// graphs oscillate without end: if the step made the loss noticeably larger, noticeably old
  /// linearisations are listed to be made again at the start of the step; without such, the step is
  /// halved.
  StepVerdict judge(const StepLimits& limits);
  /// Factors that the last judge() found too far from their linearisations.
  const std::vector<int>& stale() const { return stale_; }

 private:
  /// Sums over the judged factors.
  struct Losses {
    double loss = 0.0;
    double linearised = 0.0;  ///< Loss by the linearisations.
    double left_out = 0.0;    ///< Part of the squared residuals that they lack, at the end.
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
  std::vector<int> judged_;                 ///< Judged factors.
  std::vector<int> stale_;                  ///< Judged factors to be linearised again.
  std::vector<int> stale_before_;           ///< Factors that had to be before the step.
  std::vector<std::uint64_t> judged_at_;    ///< Per factor: number of the comparison.
  std::vector<double> factor_rotation_;     ///< Rotation of each factor then [rad].
  std::vector<std::uint64_t> variable_at_;  ///< Per variable: number of the comparison.
  std::vector<double> rotation_of_;         ///< Largest rotation of its factors [rad].
  Losses at_end_;
  double largest_deviation_ = 0.0;     ///< [sigmas]
  std::vector<graph::Delta> reached_;  ///< Values of the changed variables.
  std::uint64_t count_ = 0;            ///< Number of comparisons.
};

}  // namespace understory::factor_graph::bayes_tree
