#include "common/factor_graph/plane/smoother.hpp"

#include <stdexcept>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "common/factor_graph/plane/checkpointed_lists.hpp"

namespace understory::factor_graph::plane {
namespace {

/// Keeps a held pose invertible: a micrometre, a microradian.
const Eigen::Matrix3d kHeld = 1e12 * Eigen::Matrix3d::Identity();

}  // namespace

struct Smoother::State {
  explicit State(const bayes_tree::IncrementalParameters& parameters) : smoother(parameters) {}

  graph::VariableId name(PoseId id) const { return poses[index(id)].name; }
  graph::VariableId name(PointId id) const { return points[index(id)]; }
  graph::VariableId name(ScalarId id) const { return scalars[index(id)]; }

  /// Adds the factor to the graph; none where its information is zero.
  graph::FactorId give(const PointObservation& factor) {
    if (factor.information.isZero(0.0)) return kNoFactor;
    return smoother.add(graph::observation(name(factor.pose), name(factor.point), factor.position,
                                           factor.information));
  }
  graph::FactorId give(const RelativePose& factor) {
    if (factor.information.isZero(0.0)) return kNoFactor;
    return smoother.add(
        graph::relative(name(factor.a), name(factor.b), factor.a_T_b, factor.information));
  }
  graph::FactorId give(const BiasedRelativePose& factor) {
    const RelativePose& motion = factor.motion;
    if (motion.information.isZero(0.0)) return kNoFactor;
    return smoother.add(graph::biased_relative(name(motion.a), name(motion.b), name(factor.bias),
                                               motion.a_T_b, factor.seconds, motion.information));
  }
  graph::FactorId give(const ScalarPrior& factor) {
    if (factor.information == 0.0) return kNoFactor;
    return smoother.add(graph::prior(name(factor.scalar), factor.mean, factor.information));
  }
  graph::FactorId give(const ScalarStep& factor) {
    if (factor.information == 0.0) return kNoFactor;
    return smoother.add(graph::step(name(factor.a), name(factor.b), factor.information));
  }

  /// Appends the measurement and returns its number.
  template <typename Id, typename Measured>
  Id append(FactorList<Measured>& list, const Measured& factor) {
    list.push_back({factor, give(factor)});
    return Id(static_cast<std::uint32_t>(list.size() - 1));
  }
  template <typename Measured>
  void replace(FactorList<Measured>& list, std::uint32_t at, const Measured& factor) {
    const graph::FactorId before = list[at].factor;
    if (before != kNoFactor) smoother.remove(before);
    list.replace(at, {factor, give(factor)});
  }

  void checkpoint() {
    smoother.checkpoint();
    saved_condensed = condensed;
    saved_held = held;
    moved.clear();
    for_each_list([](auto& list) { list.commit(); });
  }
  void rollback() {
    moved.clear();
    smoother.rollback();
    condensed = saved_condensed;
    held = saved_held;
    for_each_list([](auto& list) { list.rollback(); });
  }
  template <typename Visit>
  void for_each_list(Visit&& visit) {
    visit(poses), visit(points), visit(scalars);
    visit(pose_priors), visit(relative_poses), visit(point_priors), visit(observations);
    visit(biased_relative_poses), visit(scalar_priors), visit(scalar_steps);
  }

  bayes_tree::IncrementalSmoother smoother;
  PoseList poses;
  AppendList<graph::VariableId> points;
  AppendList<graph::VariableId> scalars;
  AppendList<PosePrior> pose_priors;
  AppendList<PointPrior> point_priors;
  FactorList<RelativePose> relative_poses;
  FactorList<BiasedRelativePose> biased_relative_poses;
  FactorList<ScalarPrior> scalar_priors;
  FactorList<ScalarStep> scalar_steps;
  FactorList<PointObservation> observations;
  std::vector<graph::FactorId> condensed;
  std::vector<graph::FactorId> saved_condensed;  ///< `condensed` at the checkpoint.
  std::optional<graph::FactorId> held;
  std::optional<graph::FactorId> saved_held;  ///< `held` at the checkpoint.
  MovedList moved;
};

Smoother::Smoother(const bayes_tree::IncrementalParameters& parameters)
    : state_(std::make_unique<State>(parameters)) {}
Smoother::~Smoother() = default;
Smoother::Smoother(Smoother&&) noexcept = default;
Smoother& Smoother::operator=(Smoother&&) noexcept = default;

PoseId Smoother::add_pose(const geometry::SE2& initial) {
  const graph::VariableId name = state_->smoother.add_variable(initial);
  const std::size_t at = state_->poses.size();
  state_->poses.push_back(name);
  state_->moved.give_role(name, at);
  return PoseId(static_cast<std::uint32_t>(at));
}

PointId Smoother::add_point(const Eigen::Vector2d& initial) {
  const graph::VariableId name = state_->smoother.add_variable(initial);
  const std::size_t at = state_->points.size();
  state_->points.push_back(name);
  state_->moved.give_role(name, at);
  return PointId(static_cast<std::uint32_t>(at));
}

ScalarId Smoother::add_scalar(double initial) {
  state_->scalars.push_back(state_->smoother.add_variable(initial));
  return ScalarId(static_cast<std::uint32_t>(state_->scalars.size() - 1));
}

void Smoother::restart(PoseId id, const geometry::SE2& initial) {
  state_->smoother.restart(state_->name(id), graph::value_of(initial));
}
void Smoother::restart(PointId id, const Eigen::Vector2d& initial) {
  state_->smoother.restart(state_->name(id), graph::value_of(initial));
}
void Smoother::restart(ScalarId id, double initial) {
  state_->smoother.restart(state_->name(id), graph::value_of(initial));
}

void Smoother::park(PoseId id) {
  State& state = *state_;
  if (state.poses.is_parked(id)) throw std::invalid_argument("smoother: the pose is parked");
  const graph::VariableId name = state.name(id);
  if (state.smoother.graph().variable(index(name)).degree > 0)
    throw std::invalid_argument("smoother: a pose with factors cannot be parked");
  state.poses.replace(index(id), {graph::VariableId{graph::kNone}, pose(id)});
  state.smoother.remove(name);
}

void Smoother::unpark(PoseId id) {
  State& state = *state_;
  if (!state.poses.is_parked(id)) throw std::invalid_argument("smoother: the pose is not parked");
  const graph::VariableId name = state.smoother.add_variable(state.poses[index(id)].parked);
  state.poses.replace(index(id), {name, {}});
  state.moved.give_role(name, index(id));
}

bool Smoother::is_free(PointId id) const {
  return state_->smoother.graph().variable(index(state_->name(id))).degree == 0;
}

void Smoother::add(const PosePrior& factor) {
  state_->smoother.add(graph::prior(state_->name(factor.pose), factor.mean, factor.information));
  state_->pose_priors.push_back(factor);
}

void Smoother::add(const PointPrior& factor) {
  state_->smoother.add(graph::prior(state_->name(factor.point), factor.mean, factor.information));
  state_->point_priors.push_back(factor);
}

MotionId Smoother::add(const RelativePose& factor) {
  return state_->append<MotionId>(state_->relative_poses, factor);
}
BiasedMotionId Smoother::add(const BiasedRelativePose& factor) {
  return state_->append<BiasedMotionId>(state_->biased_relative_poses, factor);
}
ScalarPriorId Smoother::add(const ScalarPrior& factor) {
  return state_->append<ScalarPriorId>(state_->scalar_priors, factor);
}
ScalarStepId Smoother::add(const ScalarStep& factor) {
  return state_->append<ScalarStepId>(state_->scalar_steps, factor);
}
ObservationId Smoother::add(const PointObservation& factor) {
  return state_->append<ObservationId>(state_->observations, factor);
}

void Smoother::set(MotionId id, const RelativePose& factor) {
  state_->replace(state_->relative_poses, index(id), factor);
}
void Smoother::set(BiasedMotionId id, const BiasedRelativePose& factor) {
  state_->replace(state_->biased_relative_poses, index(id), factor);
}
void Smoother::set(ScalarPriorId id, const ScalarPrior& factor) {
  state_->replace(state_->scalar_priors, index(id), factor);
}
void Smoother::set(ScalarStepId id, const ScalarStep& factor) {
  state_->replace(state_->scalar_steps, index(id), factor);
}
void Smoother::set(ObservationId id, const PointObservation& factor) {
  state_->replace(state_->observations, index(id), factor);
}

void Smoother::hold(PoseId id, const geometry::SE2& mean) {
  if (state_->held) {
    const graph::FactorId before = *state_->held;
    const auto released =
        static_cast<graph::VariableId>(state_->smoother.graph().variables_of(index(before))[0]);
    state_->smoother.remove(before);
    state_->smoother.renew_scale(released);
  }
  state_->held = state_->smoother.add(graph::prior(state_->name(id), mean, kHeld));
}

void Smoother::set_condensed(std::span<const CondensedPoses> measured) {
  for (const graph::FactorId id : state_->condensed) state_->smoother.remove(id);
  state_->condensed.clear();
  for (const CondensedPoses& one : measured) {
    graph::CondensedFactor factor;
    for (const PoseId pose : one.poses) {
      factor.variables.push_back(state_->name(pose));
      state_->smoother.renew_scale(state_->name(pose));
    }
    factor.measurement.resize(3 * static_cast<Eigen::Index>(one.first_T_other.size()));
    for (std::size_t i = 0; i < one.first_T_other.size(); ++i)
      factor.measurement.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          one.first_T_other[i].coordinates();
    factor.information = one.information;
    state_->condensed.push_back(state_->smoother.add(factor));
  }
}

const RelativePose& Smoother::motion(MotionId id) const {
  return state_->relative_poses[index(id)].measured;
}
const BiasedRelativePose& Smoother::motion(BiasedMotionId id) const {
  return state_->biased_relative_poses[index(id)].measured;
}
const ScalarPrior& Smoother::prior(ScalarPriorId id) const {
  return state_->scalar_priors[index(id)].measured;
}
const ScalarStep& Smoother::step(ScalarStepId id) const {
  return state_->scalar_steps[index(id)].measured;
}
const PointObservation& Smoother::observation(ObservationId id) const {
  return state_->observations[index(id)].measured;
}

geometry::SE2 Smoother::pose(PoseId id) const {
  const PoseList::Entry& one = state_->poses[index(id)];
  return state_->poses.is_parked(id) ? one.parked : state_->smoother.pose2(one.name);
}
Eigen::Vector2d Smoother::point(PointId id) const {
  return state_->smoother.point2(state_->name(id));
}
double Smoother::scalar(ScalarId id) const {
  return state_->smoother.graph().value(state_->name(id))[0];
}

double Smoother::chi2(ObservationId id) const {
  const graph::FactorId factor = state_->observations[index(id)].factor;
  return factor == kNoFactor ? 0.0 : state_->smoother.graph().chi2(factor);
}

const std::vector<PointId>& Smoother::moved_points() const { return state_->moved.points(); }
const std::vector<PoseId>& Smoother::moved_poses() const { return state_->moved.poses(); }

Graph Smoother::graph() const {
  Graph graph;
  const State& state = *state_;

  for (std::uint32_t i = 0; i < state.poses.size(); ++i) graph.poses.push_back(pose(PoseId(i)));
  for (const graph::VariableId name : state.points.items()) {
    graph.points.push_back(state.smoother.point2(name));
  }
  for (const graph::VariableId name : state.scalars.items()) {
    graph.scalars.push_back(state.smoother.graph().value(name)[0]);
  }

  graph.pose_priors = state.pose_priors.items();
  graph.point_priors = state.point_priors.items();
  graph.relative_poses = state.relative_poses.measured();
  graph.biased_relative_poses = state.biased_relative_poses.measured();
  graph.scalar_priors = state.scalar_priors.measured();
  graph.scalar_steps = state.scalar_steps.measured();
  graph.observations = state.observations.measured();
  return graph;
}

void Smoother::start_from(const Graph& graph) {
  for (const geometry::SE2& pose : graph.poses) add_pose(pose);
  for (const Eigen::Vector2d& point : graph.points) add_point(point);
  for (const double scalar : graph.scalars) add_scalar(scalar);
  for (const PosePrior& factor : graph.pose_priors) add(factor);
  for (const BiasedRelativePose& factor : graph.biased_relative_poses) add(factor);
  for (const ScalarPrior& factor : graph.scalar_priors) add(factor);
  for (const ScalarStep& factor : graph.scalar_steps) add(factor);
  for (const RelativePose& factor : graph.relative_poses) add(factor);
  for (const PointPrior& factor : graph.point_priors) add(factor);
  for (const PointObservation& factor : graph.observations) add(factor);
}

void Smoother::checkpoint() { state_->checkpoint(); }

void Smoother::rollback() { state_->rollback(); }

void Smoother::expect_changes_at(PoseId id) {
  state_->smoother.expect_changes_at(state_->name(id));
}

SmootherUpdate Smoother::update() {
  const bayes_tree::IncrementalUpdate update = state_->smoother.update();
  state_->moved.collect(state_->smoother);
  return {update.ok, update.error};
}

std::optional<Eigen::MatrixXd> Smoother::joint_marginal(std::span<const PoseId> poses,
                                                        std::span<const PointId> points) const {
  std::vector<graph::VariableId> names;
  for (const PoseId id : poses) {
    if (state_->poses.is_parked(id)) return std::nullopt;
    names.push_back(state_->name(id));
  }
  for (const PointId id : points) names.push_back(state_->name(id));
  return state_->smoother.joint_covariance(names);
}

Marginals Smoother::marginals(std::span<const PoseId> poses,
                              std::span<const PointId> points) const {
  std::vector<graph::VariableId> names;
  std::vector<std::size_t> solved;  // Indices of poses.
  names.reserve(poses.size() + points.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (state_->poses.is_parked(poses[i])) continue;
    solved.push_back(i);
    names.push_back(state_->name(poses[i]));
  }
  for (const PointId id : points) names.push_back(state_->name(id));
  const std::vector<Eigen::MatrixXd> found = state_->smoother.covariances(names);

  Marginals result{std::vector<Eigen::Matrix3d>(poses.size(), Eigen::Matrix3d::Zero()),
                   std::vector<Eigen::Matrix2d>(points.size(), Eigen::Matrix2d::Zero())};
  for (std::size_t i = 0; i < solved.size(); ++i)
    if (found[i].size() > 0) result.poses[solved[i]] = found[i];
  for (std::size_t i = 0; i < points.size(); ++i)
    if (found[solved.size() + i].size() > 0) result.points[i] = found[solved.size() + i];
  return result;
}

std::optional<double> Smoother::variance(ScalarId id) const {
  const graph::VariableId name = state_->name(id);
  const auto covariance = state_->smoother.joint_covariance({&name, 1});
  if (!covariance) return std::nullopt;
  return (*covariance)(0, 0);
}

}  // namespace understory::factor_graph::plane
