#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory::factor_graph::bayes_tree {
namespace {

/// A pose3's chart gets a new base when its rotation exceeds this [rad].
constexpr double kFarRotation = 0.6;
/// An update that has done more than this fraction of one factorisation's work leaves further
/// iterations to the next update.
constexpr double kMostWork = 0.3;
constexpr double kAnyWork = 1e9;     ///< For an update of the whole graph.
constexpr double kLittleWork = 2e5;  ///< Less work than this never stops an update [flops].
/// A complete step on new linearisations is the last one if it changes the loss by less than this
/// fraction.
constexpr double kSettledGain = 1e-5;
/// Losses below this many squared sigmas per row are rounding.
constexpr double kLossRounding = 1e-12;
/// A single update compares changes of the loss with this value [sigma^2].
constexpr double kUsualLoss = 1.0;

/// Transforms the diagonal block at `first` to another frame: rotates rows and columns by `by`.
void rotate(Eigen::MatrixXd& covariance, Eigen::Index first, const Eigen::MatrixXd& by) {
  covariance.middleRows(first, by.rows()) = by * covariance.middleRows(first, by.rows());
  covariance.middleCols(first, by.rows()) =
      covariance.middleCols(first, by.rows()) * by.transpose();
}

/// Transforms from the chart (axes of the world) to the pose's own frame.
void to_own_frame(const graph::VariableRecord& variable, Eigen::MatrixXd& covariance,
                  Eigen::Index at) {
  if (variable.type == graph::VariableType::kPose2) {
    rotate(covariance, at, graph::pose2_of(variable.value).rotation().transpose());
  } else if (variable.type == graph::VariableType::kPose3) {
    rotate(covariance, at, graph::pose3_of(variable.value).rotation.conjugate().toRotationMatrix());
    rotate(covariance, at + 3,
           graph::right_jacobian(Eigen::Map<const Eigen::Vector3d>(variable.delta.data() + 3)));
  }
}

}  // namespace

std::string name_of(const graph::FactorGraph& graph, graph::VariableId id) {
  const graph::VariableType type = graph.type(id);
  const bool is_pose = type == graph::VariableType::kPose2 || type == graph::VariableType::kPose3;
  if (type == graph::VariableType::kScalar) return "scalar " + std::to_string(index(id));
  return (is_pose ? "pose " : "point ") + std::to_string(index(id));
}

IncrementalSmoother::IncrementalSmoother(const IncrementalParameters& parameters)
    : parameters_(parameters),
      tree_(graph_, parameters.undo_bytes),
      relinearisation_(graph_, tree_),
      judge_(graph_, tree_) {}

void IncrementalSmoother::begin_change() {
  if (updated_ && !has_checkpoint_) commit();
}

void IncrementalSmoother::commit() {
  graph_.commit();
  tree_.commit(pending_.fresh.empty());
  relinearisation_.commit();
  saved_pending_ = pending_;
  updated_ = false;
}

void IncrementalSmoother::checkpoint() {
  commit();
  has_checkpoint_ = true;
}

void IncrementalSmoother::rollback() {
  graph_.rollback();  // first: the tree computes its restored numbers from the graph
  tree_.rollback();
  relinearisation_.rollback();
  pending_ = saved_pending_;
  has_checkpoint_ = false;
  updated_ = false;
  moved_.clear();
}

graph::FactorId IncrementalSmoother::keep(graph::FactorId id) {
  pending_.fresh.push_back(index(id));
  return id;
}

void IncrementalSmoother::restart(graph::VariableId id, const graph::Value& initial) {
  begin_change();
  if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such variable");
  graph_.restart(index(id), initial);
}

void IncrementalSmoother::remove(graph::FactorId id) {
  begin_change();
  if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such factor");
  if (tree_.cliques().clique_of(index(id)) == graph::kNone) {
    std::erase(pending_.fresh, index(id));
  } else {
    // Its variables may no longer be connected: order all of them again.
    for (const int v : graph_.variables_of(index(id))) tree_.mark_structure(v);
    tree_.detach(index(id));
  }
  relinearisation_.forget_factor(index(id));
  graph_.remove(id);
}

void IncrementalSmoother::remove(graph::VariableId id) {
  begin_change();
  if (!graph_.contains(id)) throw std::invalid_argument("smoother: no such variable");
  while (graph_.variable(index(id)).first_incidence != graph::kNone) {
    remove(graph::FactorId(graph_.incidence(graph_.variable(index(id)).first_incidence).factor));
  }
  tree_.mark_structure(index(id));
  relinearisation_.forget_variable(index(id));
  pending_.doomed.push_back(index(id));
}

IncrementalSmoother::Loss IncrementalSmoother::loss() const {
  Loss loss;
  for (int f = 0; f < graph_.factor_capacity(); ++f) {
    if (!graph_.factor(f).in_use) continue;
    loss.chi2 += graph_.chi2(graph::FactorId(f));
    loss.rows += graph_.factor(f).rows;
  }
  return loss;
}

void IncrementalSmoother::collect_moved() {
  for (const int v : tree_.changed()) {
    char& is_moved = is_moved_[static_cast<std::size_t>(v)];
    if (is_moved == 0) moved_.push_back(v);
    is_moved = 1;
    const graph::VariableRecord& variable = graph_.variable(v);
    if (variable.type == graph::VariableType::kPose3 &&
        Eigen::Map<const Eigen::Vector3d>(variable.delta.data() + 3).norm() > kFarRotation) {
      relinearisation_.rebase(v);
    }
  }
}

/// Finds the variables that the next update will probably change.
void IncrementalSmoother::find_last() {
  last_.clear();
  const auto add = [&](int f) {
    for (const int v : graph_.variables_of(f)) last_.push_back(v);
  };
  const int expected = pending_.expected;
  if (expected == graph::kNone || !graph_.contains(graph::VariableId(expected))) {
    for (const int f : pending_.fresh) add(f);
    return;
  }
  for (int i = graph_.variable(expected).first_incidence; i != graph::kNone;
       i = graph_.incidence(i).next) {
    add(graph_.incidence(i).factor);
  }
}

void IncrementalSmoother::eliminate(IncrementalUpdate& update) {
  find_last();
  update.flops += tree_.eliminate(pending_.fresh, last_);
  pending_.fresh.clear();
}

/// One step; false where it was undone. `whole_loss`: for a step of the whole graph, the reference
/// loss for changes.
bool IncrementalSmoother::iterate(IncrementalUpdate& update, std::optional<double> whole_loss) {
  ++update.iterations;
  update.relinearised_factors += relinearisation_.run();
  eliminate(update);

  if (whole_loss || pending_.solve_everything) {
    // Many omitted small moves would add up to a part of the loss.
    tree_.solve_everything(whole_loss ? 0.0 : parameters_.least_move);
    pending_.solve_everything = false;
  } else {
    tree_.solve(parameters_.least_move);
  }

  const StepVerdict verdict =
      judge_.judge({parameters_.relinearise_above, whole_loss.value_or(kUsualLoss),
                    whole_loss.has_value(), update.iterations > 1});
  update.deviation = verdict.largest_deviation;
  if (verdict.is_shortened) pending_.solve_everything = true;

  for (const int f : judge_.stale()) relinearisation_.add(f);
  collect_moved();
  return verdict.is_accepted;
}

IncrementalUpdate IncrementalSmoother::run(std::optional<double> whole_loss) {
  const double most_work = whole_loss ? kAnyWork : kMostWork;
  IncrementalUpdate update;
  moved_.clear();
  is_moved_.resize(static_cast<std::size_t>(graph_.variable_capacity()), 0);

  bool accepted = true;
  do {
    accepted = iterate(update, whole_loss);
  } while (update.iterations < parameters_.max_iterations &&
           update.flops < std::max(kLittleWork, most_work * tree_.total_flops()) &&
           (!accepted || update.deviation > parameters_.iterate_above));

  for (const int v : moved_) is_moved_[static_cast<std::size_t>(v)] = 0;
  finish(update);
  return update;
}

IncrementalUpdate IncrementalSmoother::update() {
  begin_change();
  return run(std::nullopt);
}

/// The deviation of single factors is no measure of the sum over a long chain: only a step on new
/// linearisations is.
IncrementalUpdate IncrementalSmoother::whole_step(const Loss& before) {
  begin_change();
  for (const int f : factors_of_tree(tree_.cliques())) relinearisation_.add(f);
  return run(std::max(kLossRounding * before.rows, before.chi2));
}

IncrementalUpdate IncrementalSmoother::settle(int max_updates) {
  IncrementalUpdate update;
  for (int i = 0; i < max_updates && !update.is_settled; ++i) {
    const Loss before = loss();
    update = whole_step(before);
    const double change = std::abs(before.chi2 - loss().chi2);
    update.is_settled = !pending_.solve_everything &&
                        change <= std::max(kSettledGain * before.chi2, kLossRounding * before.rows);
  }
  return update;
}

IncrementalUpdate IncrementalSmoother::update_everything() {
  begin_change();
  tree_.mark_everything();
  for (int v = 0; v < graph_.variable_capacity(); ++v) {
    if (graph_.variable(v).in_use) relinearisation_.rebase(v);
  }
  return whole_step(loss());
}

void IncrementalSmoother::finish(IncrementalUpdate& update) {
  for (const int v : pending_.doomed) graph_.remove(graph::VariableId(v));
  pending_.doomed.clear();
  updated_ = true;
  if (tree_.cliques().undetermined_cliques() == 0) return;

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
  for (const int v : variables) {
    to_own_frame(graph_.variable(v), *covariance, at);
    at += dimension(graph_.variable(v).type);
  }
  return covariance;
}

std::vector<Eigen::MatrixXd> IncrementalSmoother::covariances(
    std::span<const graph::VariableId> ids) {
  std::vector<int> variables;
  variables.reserve(ids.size());
  std::vector<std::size_t> place_of(static_cast<std::size_t>(graph_.variable_capacity()));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!graph_.contains(ids[i])) continue;
    variables.push_back(index(ids[i]));
    place_of[static_cast<std::size_t>(variables.back())] = i;
  }

  std::vector<Eigen::MatrixXd> result(ids.size());
  tree_.visit_marginals(variables, [&](int v, const Eigen::Ref<const Eigen::MatrixXd>& in_chart) {
    Eigen::MatrixXd& covariance = result[place_of[static_cast<std::size_t>(v)]];
    covariance = in_chart;
    to_own_frame(graph_.variable(v), covariance, 0);
  });
  return result;
}

}  // namespace understory::factor_graph::bayes_tree
