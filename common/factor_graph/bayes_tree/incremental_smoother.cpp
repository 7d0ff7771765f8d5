#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory::factor_graph::bayes_tree {
namespace {

/// A pose3's chart is left before its rotation gets far from the base [rad].
constexpr double kFarTurn = 0.6;
/// Updates that share the work of a thorough one.
constexpr int kSweepParts = 4;
/// An update that has done more than this part of one factorisation's work leaves further
/// iterations to the next one.
constexpr double kMostWork = 0.3;
constexpr double kAnyWork = 1e9;      ///< Where the whole is asked for.
constexpr double kLittleWork = 2e5;   ///< Is no reason to [flops].
constexpr double kSettledPart = 0.2;  ///< Of the thorough updates' limit.
constexpr double kLeastUnit = 1e-4;
constexpr double kLeastUsualUnit = 0.02;

}  // namespace

std::string name_of(const graph::FactorGraph& graph, graph::VariableId id) {
  const graph::VariableType type = graph.type(id);
  const bool is_pose = type == graph::VariableType::kPose2 || type == graph::VariableType::kPose3;
  if (type == graph::VariableType::kScalar) return "scalar " + std::to_string(index(id));
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

graph::FactorId IncrementalSmoother::keep(graph::FactorId id) {
  pending_.fresh.push_back(index(id));
  return id;
}

void IncrementalSmoother::remove(graph::FactorId id) {
  begin_change();
  if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such factor");
  if (graph_.factor(index(id)).clique == graph::kNone) {
    std::erase(pending_.fresh, index(id));
  } else {
    // What it tied together may fall apart: all that it touches is ordered anew.
    for (const int v : graph_.variables_of(index(id))) tree_.mark_structure(v);
    tree_.detach(index(id));
  }
  if (graph_.factor(index(id)).is_pending) std::erase(pending_.stale, index(id));
  graph_.remove(id);
}

void IncrementalSmoother::remove(graph::VariableId id) {
  begin_change();
  if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such variable");
  while (graph_.variable(index(id)).first_incidence != graph::kNone) {
    remove(graph::FactorId(graph_.incidence(graph_.variable(index(id)).first_incidence).factor));
  }
  tree_.mark_structure(index(id));
  std::erase(pending_.rebase, index(id));
  pending_.doomed.push_back(index(id));
}

/// Linearises what is due; returns how many.
long IncrementalSmoother::relinearise() {
  for (const int v : pending_.rebase) {
    graph_.rebase(v);
    for (int i = graph_.variable(v).first_incidence; i != graph::kNone;
         i = graph_.incidence(i).next) {
      make_stale(graph_.incidence(i).factor);
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

void IncrementalSmoother::measure_unit() {
  double chi2 = 0.0;
  double rows = 1.0;
  for (int f = 0; f < graph_.factor_capacity(); ++f) {
    if (!graph_.factor(f).in_use) continue;
    chi2 += graph_.chi2(graph::FactorId(f));
    rows += graph_.factor(f).rows;
  }
  pending_.chi2 = chi2;
  pending_.unit = std::clamp(std::sqrt(chi2 / rows), kLeastUnit, 1.0);
}

/// Factors whose linearisations are noticeably old, neighbours in the tree side by side.
std::vector<int> IncrementalSmoother::noticeably_old(double relinearise_above) const {
  const double limit = relinearise_above * pending_.unit;
  std::vector<int> old;
  std::vector<int> stack{CliqueTree::kRoot};
  while (!stack.empty()) {
    const CliqueRecord& clique = tree_.clique(stack.back());
    stack.pop_back();
    for (int f = clique.first_factor; f != graph::kNone; f = graph_.factor(f).next) {
      const graph::FactorRecord& factor = graph_.factor(f);
      if (factor.is_pending) continue;
      if (graph_.deviation(f).residual > limit * part_of_rows(factor)) old.push_back(f);
    }
    for (int c = clique.first_child; c != graph::kNone; c = tree_.clique(c).next_sibling) {
      stack.push_back(c);
    }
  }
  return old;
}

void IncrementalSmoother::make_stale(int factor) {
  graph::FactorRecord& record = graph_.edit_factor(factor);
  if (record.is_pending) return;
  record.is_pending = true;
  pending_.stale.push_back(factor);
}

bool IncrementalSmoother::has_curved_charts() const {
  for (int v = 0; v < graph_.variable_capacity(); ++v) {
    if (graph_.variable(v).in_use && graph_.variable(v).type == graph::VariableType::kPose3)
      return true;
  }
  return false;
}

void IncrementalSmoother::begin_sweep() {
  measure_unit();
  pending_.sweep = noticeably_old(parameters_.thorough_relinearise_above);
  // In space charts are curved: linearisations of different ages push their neighbours to and fro.
  const int parts = has_curved_charts() ? 1 : kSweepParts;
  pending_.sweep_part = 1 + static_cast<int>(pending_.sweep.size()) / parts;
}

/// In the tree's order: each part refactorises subtrees of its own, and what is above all.
void IncrementalSmoother::take_part_of_sweep() {
  for (int i = 0; i < pending_.sweep_part && !pending_.sweep.empty(); ++i) {
    const int f = pending_.sweep.back();
    pending_.sweep.pop_back();
    // It may have been removed, and its name given to another, since.
    if (f >= graph_.factor_capacity()) continue;
    if (graph_.factor(f).in_use && graph_.factor(f).clique != graph::kNone) make_stale(f);
  }
}

void IncrementalSmoother::collect_moved() {
  for (const int v : tree_.changed()) {
    if (moved_at_[static_cast<std::size_t>(v)] != 1) moved_.push_back(v);
    moved_at_[static_cast<std::size_t>(v)] = 1;
    const graph::VariableRecord& variable = graph_.variable(v);
    if (variable.type == graph::VariableType::kPose3 &&
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
  for (const int f : off_) make_stale(f);
  collect_moved();
  return accepted;
}

IncrementalUpdate IncrementalSmoother::run(bool thorough, double most_work) {
  IncrementalUpdate update;
  moved_.clear();
  moved_at_.resize(static_cast<std::size_t>(graph_.variable_capacity()), 0);
  pending_.since_thorough = thorough ? 0 : pending_.since_thorough + 1;
  bool accepted = true;
  do {
    accepted = iterate(update, thorough);
  } while (update.iterations < parameters_.max_iterations &&
           update.flops < std::max(kLittleWork, most_work * tree_.total_flops()) &&
           (!accepted || update.deviation > parameters_.iterate_above));
  update.moved_variables = static_cast<long>(moved_.size());
  for (const int v : moved_) moved_at_[static_cast<std::size_t>(v)] = 0;
  finish(update);
  return update;
}

IncrementalUpdate IncrementalSmoother::run_thoroughly(double relinearise_above) {
  begin_change();
  measure_unit();
  pending_.sweep.clear();
  for (const int f : noticeably_old(relinearise_above)) make_stale(f);
  return run(true, kAnyWork);
}

IncrementalUpdate IncrementalSmoother::update() {
  begin_change();
  const bool is_sweeping = !pending_.sweep.empty();
  if (is_sweeping) {
    take_part_of_sweep();
  } else if (parameters_.thorough_every > 0 &&
             pending_.since_thorough + 1 >= parameters_.thorough_every) {
    begin_sweep();
    if (pending_.sweep.empty()) return run(true, kMostWork);
  }
  return run(is_sweeping && pending_.sweep.empty(), kMostWork);
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
  for (const int v : pending_.doomed) graph_.remove(graph::VariableId(v));
  pending_.doomed.clear();
  updated_ = true;
  if (tree_.undetermined_cliques() == 0) return;
  update.ok = false;
  for (const int v : tree_.undetermined()) {
    update.undetermined.push_back(graph::VariableId(v));
    if (!update.error.empty()) update.error += ", ";
    update.error += name_of(graph_, graph::VariableId(v));
  }
  update.error += update.undetermined.size() == 1 ? " is" : " are";
  update.error += " not determined by the measurements";
}

std::optional<Eigen::MatrixXd> IncrementalSmoother::joint_covariance(
    std::span<const graph::VariableId> ids) {
  std::vector<int> variables;
  for (const graph::VariableId id : ids) {
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
    const graph::VariableRecord& variable = graph_.variable(v);
    if (variable.type == graph::VariableType::kPose2) {
      turn(at, graph::pose2_of(variable.value).rotation().transpose());
    } else if (variable.type == graph::VariableType::kPose3) {
      turn(at, graph::pose3_of(variable.value).rotation.conjugate().toRotationMatrix());
      turn(at + 3,
           graph::right_jacobian(Eigen::Map<const Eigen::Vector3d>(variable.delta.data() + 3)));
    }
    at += dimension(variable.type);
  }
  return covariance;
}

}  // namespace understory::factor_graph::bayes_tree
