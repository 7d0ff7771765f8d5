// How good a step is: factors against their linearisations.
#include <algorithm>
#include <cmath>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

/// What the linearisations leave out is looked at from this part of the loss on; a step must keep
/// the other part of what they promised.
constexpr double kNoticedPart = 0.1;
constexpr double kNoticedRounding = 1e-3;  ///< The same of thorough updates, which start fresh.
constexpr double kLeastGain = 0.1;
constexpr int kMaxHalvings = 8;
/// Residuals of more rows than these are as large as those of so many.
constexpr int kMostRows = 6;
constexpr double kPlanarRows = 3.0;

}  // namespace

double IncrementalSmoother::part_of_rows(const graph::FactorRecord& factor) {
  return std::sqrt(std::clamp<double>(factor.rows, kPlanarRows, kMostRows) / kPlanarRows);
}

void IncrementalSmoother::judge_factor(int factor, double limit) {
  judged_.push_back(factor);
  judged_at_[static_cast<std::size_t>(factor)] = count_;
  const graph::Deviation deviation = graph_.deviation(factor);
  factor_turned_[static_cast<std::size_t>(factor)] = deviation.turned;
  at_end_.loss += deviation.loss;
  at_end_.linearised += deviation.linearised;
  at_end_.left_out += deviation.left_out;
  largest_deviation_ = std::max(largest_deviation_, deviation.residual);
  if (deviation.residual > limit * part_of_rows(graph_.factor(factor))) off_.push_back(factor);
}

/// Compares the factors of the variables that moved with their linearisations, where the moves are
/// such that it can matter; those that are off become stale. Returns the largest deviation.
double IncrementalSmoother::judge(double unless_below, double limit) {
  ++count_;
  judged_.clear();
  judged_variables_.clear();
  off_.clear();
  judged_at_.resize(static_cast<std::size_t>(graph_.factor_capacity()), 0);
  factor_turned_.resize(judged_at_.size());
  at_end_ = {};
  largest_deviation_ = 0.0;
  for (const int v : tree_.changed()) {
    if (graph_.unjudged_deviation(v) < unless_below) continue;
    judged_variables_.push_back(v);
    for (int i = graph_.variable(v).first_incidence; i != graph::kNone;
         i = graph_.incidence(i).next) {
      const int f = graph_.incidence(i).factor;
      if (judged_at_[static_cast<std::size_t>(f)] != count_) judge_factor(f, limit);
    }
  }
  keep_judgement();
  return largest_deviation_;
}

/// The variables' factors were looked at where these are now.
void IncrementalSmoother::keep_judgement() {
  for (const int v : judged_variables_) {
    double turned = 0.0;
    for (int i = graph_.variable(v).first_incidence; i != graph::kNone;
         i = graph_.incidence(i).next) {
      turned =
          std::max(turned, factor_turned_[static_cast<std::size_t>(graph_.incidence(i).factor)]);
    }
    graph::VariableRecord& variable = graph_.edit_variable(v);
    variable.judged = variable.delta;
    variable.turned = turned;
  }
}

/// What the step did to the judged factors' losses, by going back to where it began and looking at
/// them there: those that are noticeably old even there are `old_`.
IncrementalSmoother::Losses IncrementalSmoother::go_back(double limit) {
  reached_.clear();
  for (const int v : tree_.changed()) reached_.push_back(graph_.variable(v).delta);
  move_changed(tree_.changed_from());
  Losses change = at_end_;
  old_.clear();
  for (const int f : judged_) {
    const graph::Deviation deviation = graph_.deviation(f);
    factor_turned_[static_cast<std::size_t>(f)] = deviation.turned;
    change.loss -= deviation.loss;
    change.linearised -= deviation.linearised;
    if (deviation.residual > limit * part_of_rows(graph_.factor(f))) old_.push_back(f);
  }
  return change;
}

void IncrementalSmoother::move_changed(const std::vector<graph::Delta>& to) {
  const std::vector<int>& changed = tree_.changed();
  for (std::size_t i = 0; i < changed.size(); ++i) graph_.move(changed[i], to[i].data());
}

void IncrementalSmoother::go_half_the_way() {
  for (std::size_t i = 0; i < reached_.size(); ++i) {
    const graph::Delta& from = tree_.changed_from()[i];
    for (std::size_t k = 0; k < from.size(); ++k) reached_[i][k] = 0.5 * (from[k] + reached_[i][k]);
  }
  move_changed(reached_);
}

/// False where the step is taken back. Linearisations of different ages that do not fit together
/// push large graphs to and fro without end: then those that are noticeably old are to be made
/// anew, where the step began. Where there are none it is halved.
bool IncrementalSmoother::accept_step(IncrementalUpdate& update, bool thorough) {
  const double limit = parameters_.relinearise_above * usual_unit();
  const double part = thorough ? kNoticedRounding : kNoticedPart;
  const double noticed = part * std::max(pending_.unit * pending_.unit, pending_.chi2);
  const bool is_repeated = update.iterations > 1;
  for (int i = 0; i < kMaxHalvings && at_end_.left_out > noticed; ++i) {
    const Losses change = go_back(kNegligible * limit);
    const bool promised_more = is_repeated && change.loss - change.linearised > noticed &&
                               change.loss > kLeastGain * change.linearised;
    if (change.loss <= noticed && !promised_more) {
      move_changed(reached_);
      return true;
    }
    pending_.solve_everything = true;
    if (i == 0 && !old_.empty()) {
      off_ = old_;
      keep_judgement();
      return false;
    }
    go_half_the_way();
    update.deviation = judge(0.0, limit);
  }
  return true;
}

}  // namespace understory::factor_graph::bayes_tree
