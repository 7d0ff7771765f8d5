#include "common/factor_graph/bayes_tree/step_judge.hpp"

#include <algorithm>
#include <utility>

#include "common/factor_graph/bayes_tree/relinearisation.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

/// Fraction of the limit on deviations by which a deviation may grow unchecked.
constexpr double kNegligible = 0.2;
/// Errors of the linearisations are checked from this fraction of the loss on; kLeastGain: fraction
/// of the promised gain that a step must reach.
constexpr double kNoticedPart = 0.1;
/// The same for thorough updates, which start with new linearisations.
constexpr double kNoticedRounding = 1e-3;
constexpr double kLeastGain = 0.1;
constexpr int kMaxHalvings = 8;
/// Number of table entries read in the time of one access to a list entry.
constexpr int kTableEntriesPerWait = 8;

}  // namespace

void StepJudge::compare_factor(int factor, double limit) {
  const graph::Deviation deviation = graph_.deviation(factor);
  factor_rotation_[static_cast<std::size_t>(factor)] = deviation.rotated;
  at_end_.loss += deviation.loss;
  at_end_.linearised += deviation.linearised;
  at_end_.left_out += deviation.left_out;
  largest_deviation_ = std::max(largest_deviation_, deviation.residual);
  if (deviation.residual > limit * limit_scale(graph_.factor(factor))) stale_.push_back(factor);
}

/// Lists the factors of the moved variables if the moves are large enough to matter.
void StepJudge::list_judged(double unless_below) {
  ++count_;
  judged_.clear();
  judged_variables_.clear();
  judged_at_.resize(static_cast<std::size_t>(graph_.factor_capacity()), 0);
  factor_rotation_.resize(judged_at_.size());
  variable_at_.resize(static_cast<std::size_t>(graph_.variable_capacity()), 0);
  rotation_of_.resize(variable_at_.size());

  int factors = 0;  // Counted with repetitions.
  for (const int v : tree_.changed()) {
    if (graph_.unjudged_deviation(v) < unless_below) continue;
    judged_variables_.push_back(v);
    variable_at_[static_cast<std::size_t>(v)] = count_;
    factors += graph_.variable(v).degree;
  }

  // For many factors the whole table is read in memory order: following lists waits for memory at
  // every entry.
  if (factors > graph_.factor_capacity() / kTableEntriesPerWait) {
    graph_.list_factors([&](int v) { return is_judged(v); }, judged_);
    return;
  }
  for (const int v : judged_variables_) {
    for (int i = graph_.variable(v).first_incidence; i != graph::kNone;
         i = graph_.incidence(i).next) {
      const int f = graph_.incidence(i).factor;
      if (std::exchange(judged_at_[static_cast<std::size_t>(f)], count_) != count_)
        judged_.push_back(f);
    }
  }
}

/// Compares factors with their linearisations. Returns the largest deviation.
double StepJudge::compare(double unless_below, double limit) {
  list_judged(unless_below);
  stale_.clear();
  at_end_ = {};
  largest_deviation_ = 0.0;
  for (std::size_t i = 0; i < judged_.size(); ++i) {
    if (i + 2 * graph::kFetchAhead < judged_.size())
      graph_.fetch_record(judged_[i + 2 * graph::kFetchAhead]);
    if (i + graph::kFetchAhead < judged_.size())
      graph_.fetch_numbers(judged_[i + graph::kFetchAhead]);
    compare_factor(judged_[i], limit);
  }

  keep_comparison();
  return largest_deviation_;
}

/// Stores the present values as those of the last comparison.
void StepJudge::keep_comparison() {
  for (const int v : judged_variables_) rotation_of_[static_cast<std::size_t>(v)] = 0.0;
  for (const int f : judged_) {
    const double rotated = factor_rotation_[static_cast<std::size_t>(f)];
    for (const int v : graph_.variables_of(f)) {
      double& most = rotation_of_[static_cast<std::size_t>(v)];
      most = std::max(most, rotated);
    }
  }
  for (const int v : judged_variables_) {
    graph::VariableRecord& variable = graph_.edit_variable(v);
    variable.judged = variable.delta;
    variable.rotated = rotation_of_[static_cast<std::size_t>(v)];
  }
}

/// Returns to the start of the step. Returns the changes of the judged factors' losses by the step;
/// factors noticeably old even at the start go to `stale_before_`.
StepJudge::Losses StepJudge::go_back(double limit) {
  reached_.clear();
  for (const int v : tree_.changed()) reached_.push_back(graph_.variable(v).delta);
  move_changed(tree_.changed_from());

  Losses change = at_end_;
  stale_before_.clear();
  for (const int f : judged_) {
    const graph::Deviation deviation = graph_.deviation(f);
    factor_rotation_[static_cast<std::size_t>(f)] = deviation.rotated;
    change.loss -= deviation.loss;
    change.linearised -= deviation.linearised;
    if (deviation.residual > limit * limit_scale(graph_.factor(f))) stale_before_.push_back(f);
  }
  return change;
}

void StepJudge::move_changed(const std::vector<graph::Delta>& to) {
  const std::vector<int>& changed = tree_.changed();
  for (std::size_t i = 0; i < changed.size(); ++i) graph_.move(changed[i], to[i].data());
}

void StepJudge::go_half_the_distance() {
  for (std::size_t i = 0; i < reached_.size(); ++i) {
    const graph::Delta& from = tree_.changed_from()[i];
    for (std::size_t k = 0; k < from.size(); ++k) reached_[i][k] = 0.5 * (from[k] + reached_[i][k]);
  }
  move_changed(reached_);
}

StepVerdict StepJudge::judge(const StepLimits& limits) {
  const double limit = limits.relinearise_above;
  const double noticed = (limits.is_thorough ? kNoticedRounding : kNoticedPart) * limits.loss;
  StepVerdict verdict;
  verdict.largest_deviation = compare(kNegligible * limit, limit);

  for (int i = 0; i < kMaxHalvings && at_end_.left_out > noticed; ++i) {
    // Did the loss grow, or did a repeated step gain too little of its prediction?
    const Losses change = go_back(kNegligible * limit);
    const bool promised_more = limits.is_repeated && change.loss - change.linearised > noticed &&
                               change.loss > kLeastGain * change.linearised;
    if (change.loss <= noticed && !promised_more) {
      move_changed(reached_);
      return verdict;
    }

    // First remedy: renew old linearisations.
    verdict.is_shortened = true;
    if (i == 0 && !stale_before_.empty()) {
      stale_ = stale_before_;
      keep_comparison();
      verdict.is_accepted = false;
      return verdict;
    }

    // Second remedy: halve the step.
    go_half_the_distance();
    verdict.largest_deviation = compare(0.0, limit);
  }
  return verdict;
}

}  // namespace understory::factor_graph::bayes_tree
