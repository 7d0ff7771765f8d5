#include "common/factor_graph/incremental_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory {
namespace {

/// A pose3's chart is left before its rotation gets far from the base [rad].
constexpr double kFarTurn = 0.6;
/// What the linearisations leave out is looked at from this part of the loss on; a step must keep
/// the other part of what they promised.
constexpr double kNoticedPart = 0.1;
constexpr double kNoticedRounding = 1e-3;  ///< The same of thorough updates, which start fresh.
constexpr double kLeastGain = 0.1;
constexpr int kMaxHalvings = 8;
/// Part of the limit to deviations, that may grow unseen.
constexpr double kNegligible = 0.2;
/// Residuals of more rows than these are as large as those of so many.
constexpr int kMostRows = 6;
constexpr double kPlanarRows = 3.0;
constexpr double kSettledPart = 0.2;  ///< Of the thorough updates' limit.
constexpr double kLeastUnit = 1e-4;
constexpr double kLeastUsualUnit = 0.02;

/// Limits are stated for relative poses in the plane; a residual in space is larger by its rows.
double part_of_rows(const FactorRecord& factor) {
  return std::sqrt(std::clamp<double>(factor.rows, kPlanarRows, kMostRows) / kPlanarRows);
}

}  // namespace

std::string name_of(const FactorGraph& graph, VariableId id) {
  const VariableType type = graph.type(id);
  const bool is_pose = type == VariableType::kPose2 || type == VariableType::kPose3;
  return (is_pose ? "pose " : "point ") + std::to_string(index(id));
}

IncrementalSmoother::IncrementalSmoother(const IncrementalParameters& parameters)
    : parameters_(parameters), tree_(graph_) {
  pending_.unit = saved_pending_.unit = parameters.first_unit;
}

/// Single updates need not follow the thorough ones all the way down.
double IncrementalSmoother::usual_unit() const { return std::max(kLeastUsualUnit, pending_.unit); }

void IncrementalSmoother::begin_change() {
  if (updated_ && !has_checkpoint_) commit();
}

void IncrementalSmoother::commit() {
  graph_.commit();
  tree_.commit();
  saved_pending_ = pending_;
  updated_ = false;
}

void IncrementalSmoother::checkpoint() {
  commit();
  has_checkpoint_ = true;
}

void IncrementalSmoother::rollback() {
  tree_.rollback();
  graph_.rollback();
  pending_ = saved_pending_;
  has_checkpoint_ = false;
  updated_ = false;
  moved_.clear();
}

FactorId IncrementalSmoother::keep(FactorId id) {
  pending_.fresh.push_back(index(id));
  return id;
}

void IncrementalSmoother::remove(FactorId id) {
  begin_change();
  if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such factor");
  if (graph_.factor(index(id)).clique == kNone) {
    std::erase(pending_.fresh, index(id));
  } else {
    // What it tied together may fall apart: all that it touches is ordered anew.
    for (const int v : graph_.variables_of(index(id))) tree_.mark_structure(v);
    tree_.detach(index(id));
  }
  if (graph_.factor(index(id)).is_pending) std::erase(pending_.stale, index(id));
  graph_.remove(id);
}

void IncrementalSmoother::remove(VariableId id) {
  begin_change();
  if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such variable");
  while (graph_.variable(index(id)).first_incidence != kNone) {
    remove(FactorId(graph_.incidence(graph_.variable(index(id)).first_incidence).factor));
  }
  tree_.mark_structure(index(id));
  std::erase(pending_.rebase, index(id));
  pending_.doomed.push_back(index(id));
}

/// Linearises what is due; returns how many.
long IncrementalSmoother::relinearise() {
  for (const int v : pending_.rebase) {
    graph_.rebase(v);
    for (int i = graph_.variable(v).first_incidence; i != kNone; i = graph_.incidence(i).next) {
      FactorRecord& factor = graph_.edit_factor(graph_.incidence(i).factor);
      if (factor.is_pending) continue;
      factor.is_pending = true;
      pending_.stale.push_back(graph_.incidence(i).factor);
    }
  }
  pending_.rebase.clear();
  for (const int f : pending_.stale) {
    graph_.edit_factor(f).is_pending = false;
    graph_.linearise(f);
    tree_.mark_numbers(f);
  }
  const auto count = static_cast<long>(pending_.stale.size());
  pending_.stale.clear();
  return count;
}

/// Compares the factors of the variables that moved with their linearisations, where the moves are
/// such that it can matter; those that are off become stale. Sums up what the linearisations leave
/// out of the loss. Returns the largest deviation.
double IncrementalSmoother::judge(double unless_below, double limit) {
  ++count_;
  judged_.clear();
  off_.clear();
  judged_at_.resize(static_cast<std::size_t>(graph_.factor_capacity()), 0);
  left_out_loss_ = 0.0;
  double largest = 0.0;
  for (const int v : tree_.changed()) {
    if (graph_.unjudged_deviation(v) < unless_below) continue;
    double turned = 0.0;
    for (int i = graph_.variable(v).first_incidence; i != kNone; i = graph_.incidence(i).next) {
      const int f = graph_.incidence(i).factor;
      if (judged_at_[static_cast<std::size_t>(f)] == count_) continue;
      judged_at_[static_cast<std::size_t>(f)] = count_;
      judged_.push_back(f);
      const Deviation deviation = graph_.deviation(f);
      turned = std::max(turned, deviation.turned);
      left_out_loss_ += deviation.loss;
      largest = std::max(largest, deviation.residual);
      if (deviation.residual > limit * part_of_rows(graph_.factor(f))) off_.push_back(f);
    }
    VariableRecord& variable = graph_.edit_variable(v);
    variable.judged = variable.delta;
    variable.turned = turned;
  }
  return largest;
}

/// What the step did to the judged factors.
IncrementalSmoother::StepEffect IncrementalSmoother::effect_of_step() {
  StepEffect effect;
  for (const int f : judged_) {
    effect.loss += graph_.chi2(FactorId(f));
    effect.linearised += graph_.linearised_chi2(f);
  }
  reached_.clear();
  for (const int v : tree_.changed()) reached_.push_back(graph_.variable(v).delta);
  move_changed(tree_.changed_from());
  for (const int f : judged_) {
    effect.loss -= graph_.chi2(FactorId(f));
    effect.linearised -= graph_.linearised_chi2(f);
  }
  move_changed(reached_);
  return effect;
}

void IncrementalSmoother::move_changed(const std::vector<Delta>& to) {
  const std::vector<int>& changed = tree_.changed();
  for (std::size_t i = 0; i < changed.size(); ++i) graph_.move(changed[i], to[i].data());
}

void IncrementalSmoother::halve_step() {
  for (std::size_t i = 0; i < reached_.size(); ++i) {
    const Delta& from = tree_.changed_from()[i];
    for (std::size_t k = 0; k < from.size(); ++k) reached_[i][k] = 0.5 * (from[k] + reached_[i][k]);
  }
  move_changed(reached_);
}

/// Whether the step does far less for the loss than the linearisations promise.
bool IncrementalSmoother::is_bad_step(bool thorough, bool is_repeated) {
  const double part = thorough ? kNoticedRounding : kNoticedPart;
  const double noticed = part * std::max(pending_.unit * pending_.unit, pending_.chi2);
  if (left_out_loss_ <= noticed) return false;
  const StepEffect effect = effect_of_step();
  if (effect.loss > noticed) return true;
  return is_repeated && effect.loss - effect.linearised > noticed &&
         effect.loss > kLeastGain * effect.linearised;
}

/// False where the step is taken back. Linearisations of different ages that do not fit together
/// push large graphs to and fro without end: then those that are noticeably old are to be made
/// anew, where the step began. Where there are none it is halved.
bool IncrementalSmoother::accept_step(IncrementalUpdate& update, bool thorough) {
  const double limit = parameters_.relinearise_above * usual_unit();
  for (int i = 0; i < kMaxHalvings && is_bad_step(thorough, update.iterations > 1); ++i) {
    pending_.solve_everything = true;
    if (i == 0) {
      move_changed(tree_.changed_from());
      judge(0.0, kNegligible * limit);
      if (!off_.empty()) return false;
    }
    halve_step();
    update.deviation = judge(0.0, limit);
  }
  return true;
}

/// Every factor whose linearisation is noticeably old becomes stale.
void IncrementalSmoother::look_at_all(double relinearise_above) {
  double chi2 = 0.0;
  double rows = 1.0;
  for (int f = 0; f < graph_.factor_capacity(); ++f) {
    if (!graph_.factor(f).in_use) continue;
    chi2 += graph_.chi2(FactorId(f));
    rows += graph_.factor(f).rows;
  }
  pending_.chi2 = chi2;
  pending_.unit = std::clamp(std::sqrt(chi2 / rows), kLeastUnit, 1.0);
  const double limit = relinearise_above * pending_.unit;
  for (int f = 0; f < graph_.factor_capacity(); ++f) {
    const FactorRecord& factor = graph_.factor(f);
    if (!factor.in_use || factor.clique == kNone || factor.is_pending) continue;
    if (graph_.deviation(f).residual <= limit * part_of_rows(factor)) continue;
    graph_.edit_factor(f).is_pending = true;
    pending_.stale.push_back(f);
  }
}

void IncrementalSmoother::collect_moved() {
  for (const int v : tree_.changed()) {
    if (moved_at_[static_cast<std::size_t>(v)] != 1) moved_.push_back(v);
    moved_at_[static_cast<std::size_t>(v)] = 1;
    const VariableRecord& variable = graph_.variable(v);
    if (variable.type == VariableType::kPose3 &&
        Eigen::Map<const Eigen::Vector3d>(variable.delta.data() + 3).norm() > kFarTurn) {
      pending_.rebase.push_back(v);
    }
  }
}

bool IncrementalSmoother::iterate(IncrementalUpdate& update, bool thorough) {
  ++update.iterations;
  update.relinearised_factors += relinearise();
  last_.clear();
  for (const int f : pending_.fresh) {
    for (const int v : graph_.variables_of(f)) last_.push_back(v);
  }
  const TreeStatistics statistics = tree_.eliminate(pending_.fresh, last_);
  pending_.fresh.clear();
  update.eliminated_variables += statistics.eliminated_variables;
  update.refreshed_cliques += statistics.refreshed_cliques;
  update.flops += statistics.flops;
  if (pending_.solve_everything || thorough) {
    pending_.solve_everything = false;
    tree_.solve_everything(thorough ? parameters_.thorough_move * pending_.unit
                                    : parameters_.least_move * usual_unit());
  } else {
    const double finest = parameters_.least_move * usual_unit();
    tree_.solve({finest, parameters_.wait_below * finest, parameters_.turns});
  }
  const double limit = parameters_.relinearise_above * usual_unit();
  update.deviation = judge(kNegligible * limit, limit);
  const bool accepted = accept_step(update, thorough);
  for (const int f : off_) {
    FactorRecord& factor = graph_.edit_factor(f);
    if (factor.is_pending) continue;
    factor.is_pending = true;
    pending_.stale.push_back(f);
  }
  collect_moved();
  return accepted;
}

IncrementalUpdate IncrementalSmoother::run(bool thorough) {
  IncrementalUpdate update;
  moved_.clear();
  moved_at_.resize(static_cast<std::size_t>(graph_.variable_capacity()), 0);
  pending_.since_thorough = thorough ? 0 : pending_.since_thorough + 1;
  bool accepted = true;
  do {
    accepted = iterate(update, thorough);
  } while (update.iterations < parameters_.max_iterations &&
           (!accepted || update.deviation > parameters_.iterate_above));
  update.moved_variables = static_cast<long>(moved_.size());
  for (const int v : moved_) moved_at_[static_cast<std::size_t>(v)] = 0;
  finish(update);
  return update;
}

IncrementalUpdate IncrementalSmoother::run_thoroughly(double relinearise_above) {
  begin_change();
  look_at_all(relinearise_above);
  return run(true);
}

IncrementalUpdate IncrementalSmoother::update() {
  if (parameters_.thorough_every > 0 && pending_.since_thorough + 1 >= parameters_.thorough_every) {
    return update_thoroughly();
  }
  begin_change();
  return run(false);
}

IncrementalUpdate IncrementalSmoother::update_thoroughly() {
  return run_thoroughly(parameters_.thorough_relinearise_above);
}

IncrementalUpdate IncrementalSmoother::settle(int max_updates) {
  const double limit = kSettledPart * parameters_.thorough_relinearise_above;
  IncrementalUpdate update = run_thoroughly(limit);
  const auto is_settled = [&] {
    return update.relinearised_factors == 0 && !pending_.solve_everything && pending_.stale.empty();
  };
  for (int i = 1; i < max_updates && !is_settled(); ++i) {
    update = run_thoroughly(limit);
  }
  return update;
}

IncrementalUpdate IncrementalSmoother::update_everything() {
  begin_change();
  tree_.mark_everything();
  for (int v = 0; v < graph_.variable_capacity(); ++v) {
    if (graph_.variable(v).in_use) pending_.rebase.push_back(v);
  }
  return update_thoroughly();
}

void IncrementalSmoother::finish(IncrementalUpdate& update) {
  for (const int v : pending_.doomed) graph_.remove(VariableId(v));
  pending_.doomed.clear();
  updated_ = true;
  if (tree_.undetermined_cliques() == 0) return;
  update.ok = false;
  for (const int v : tree_.undetermined()) {
    update.undetermined.push_back(VariableId(v));
    if (!update.error.empty()) update.error += ", ";
    update.error += name_of(graph_, VariableId(v));
  }
  update.error += update.undetermined.size() == 1 ? " is" : " are";
  update.error += " not determined by the measurements";
}

std::optional<Eigen::MatrixXd> IncrementalSmoother::joint_covariance(
    std::span<const VariableId> ids) {
  std::vector<int> variables;
  for (const VariableId id : ids) {
    if (!graph_.contains(id)) return std::nullopt;
    variables.push_back(index(id));
  }
  std::optional<Eigen::MatrixXd> covariance = tree_.joint_covariance(variables);
  if (!covariance) return covariance;
  Eigen::Index at = 0;
  const auto turn = [&](Eigen::Index first, const Eigen::MatrixXd& by) {
    covariance->middleRows(first, by.rows()) = by * covariance->middleRows(first, by.rows());
    covariance->middleCols(first, by.rows()) =
        covariance->middleCols(first, by.rows()) * by.transpose();
  };
  for (const int v : variables) {
    const VariableRecord& variable = graph_.variable(v);
    if (variable.type == VariableType::kPose2) {
      turn(at, pose2_of(variable.value).rotation().transpose());
    } else if (variable.type == VariableType::kPose3) {
      turn(at, pose3_of(variable.value).rotation.conjugate().toRotationMatrix());
      turn(at + 3, right_jacobian(Eigen::Map<const Eigen::Vector3d>(variable.delta.data() + 3)));
    }
    at += dimension(variable.type);
  }
  return covariance;
}

}  // namespace understory
