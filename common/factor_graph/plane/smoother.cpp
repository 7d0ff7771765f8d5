#include "common/factor_graph/plane/smoother.hpp"

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

namespace understory::factor_graph::plane {
namespace {

constexpr graph::FactorId kNoFactor{graph::kNone};

bayes_tree::IncrementalParameters incremental(const SmootherParameters& parameters) {
  bayes_tree::IncrementalParameters result;
  result.least_move = parameters.least_move;
  result.relinearise_above = parameters.relinearise_above;
  result.iterate_above = parameters.iterate_above;
  result.max_iterations = parameters.max_iterations;
  // The mapper's noise is as it says, and its cost must not follow the map.
  result.first_unit = 1.0;
  result.thorough_every = 0;
  result.wait_below = parameters.wait_below;
  result.waiting_slots = parameters.waiting_slots;
  return result;
}

}  // namespace

struct Smoother::State {
  struct Observation {
    PointObservation measured;
    graph::FactorId factor = kNoFactor;
  };
  struct Change {
    std::size_t at = 0;
    Observation before;
  };
  struct Counts {
    std::size_t poses = 0, points = 0, observations = 0, pose_priors = 0, relative_poses = 0,
                point_priors = 0, scalars = 0, biased_relative_poses = 0, scalar_priors = 0,
                scalar_steps = 0;
  };

  explicit State(const SmootherParameters& parameters) : smoother(incremental(parameters)) {}

  Counts counts() const {
    return {poses.size(),          points.size(),
            observations.size(),   pose_priors.size(),
            relative_poses.size(), point_priors.size(),
            scalars.size(),        biased_relative_poses.size(),
            scalar_priors.size(),  scalar_steps.size()};
  }
  graph::VariableId name(PoseId id) const { return poses[index(id)]; }
  graph::VariableId name(PointId id) const { return points[index(id)]; }
  graph::VariableId name(ScalarId id) const { return scalars[index(id)]; }
  graph::FactorId give(const PointObservation& factor) {
    if (factor.information.isZero(0.0)) return kNoFactor;
    return smoother.add(graph::observation(name(factor.pose), name(factor.point), factor.position,
                                           factor.information));
  }

  std::uint32_t take_role(graph::VariableId name, std::size_t at) {
    const auto slot = static_cast<std::size_t>(index(name));
    if (roles.size() <= slot) roles.resize(slot + 1);
    roles[slot] = {static_cast<std::uint32_t>(at), false};
    return roles[slot].index;
  }
  void collect_moved() {
    for (const int v : smoother.moved()) {
      const graph::VariableType type = smoother.graph().type(graph::VariableId(v));
      if (type == graph::VariableType::kScalar) continue;
      Role& role = roles[static_cast<std::size_t>(v)];
      if (role.is_moved) continue;
      role.is_moved = true;
      if (type == graph::VariableType::kPose2) {
        moved_poses.push_back(PoseId(role.index));
      } else {
        moved_points.push_back(PointId(role.index));
      }
    }
  }
  void forget_moved() {
    for (const PoseId id : moved_poses) roles[slot(name(id))].is_moved = false;
    for (const PointId id : moved_points) roles[slot(name(id))].is_moved = false;
    moved_poses.clear();
    moved_points.clear();
  }
  static std::size_t slot(graph::VariableId id) { return static_cast<std::size_t>(index(id)); }

  bayes_tree::IncrementalSmoother smoother;
  std::vector<graph::VariableId> poses;
  std::vector<graph::VariableId> points;
  struct Role {
    std::uint32_t index = 0;  ///< Among the poses, or among the points.
    bool is_moved = false;
  };
  std::vector<Role> roles;  ///< Per variable.
  std::vector<Observation> observations;
  std::vector<PosePrior> pose_priors;
  std::vector<RelativePose> relative_poses;
  std::vector<PointPrior> point_priors;
  std::vector<graph::VariableId> scalars;
  std::vector<BiasedRelativePose> biased_relative_poses;
  std::vector<ScalarPrior> scalar_priors;
  std::vector<ScalarStep> scalar_steps;
  Counts saved;
  std::vector<Change> changes;  ///< Of observations, since the checkpoint.
  std::vector<PoseId> moved_poses;
  std::vector<PointId> moved_points;
};

Smoother::Smoother(const SmootherParameters& parameters)
    : state_(std::make_unique<State>(parameters)) {}
Smoother::~Smoother() = default;
Smoother::Smoother(Smoother&&) noexcept = default;
Smoother& Smoother::operator=(Smoother&&) noexcept = default;

PoseId Smoother::add_pose(const geometry::SE2& initial) {
  const graph::VariableId name = state_->smoother.add_variable(initial);
  state_->poses.push_back(name);
  return PoseId(state_->take_role(name, state_->poses.size() - 1));
}

PointId Smoother::add_point(const Eigen::Vector2d& initial) {
  const graph::VariableId name = state_->smoother.add_variable(initial);
  state_->points.push_back(name);
  return PointId(state_->take_role(name, state_->points.size() - 1));
}

ScalarId Smoother::add_scalar(double initial) {
  state_->scalars.push_back(state_->smoother.add_variable(initial));
  return ScalarId(static_cast<std::uint32_t>(state_->scalars.size() - 1));
}

void Smoother::add(const PosePrior& factor) {
  state_->smoother.add(prior(state_->name(factor.pose), factor.mean, factor.information));
  state_->pose_priors.push_back(factor);
}

void Smoother::add(const RelativePose& factor) {
  state_->smoother.add(
      relative(state_->name(factor.a), state_->name(factor.b), factor.a_T_b, factor.information));
  state_->relative_poses.push_back(factor);
}

void Smoother::add(const PointPrior& factor) {
  state_->smoother.add(prior(state_->name(factor.point), factor.mean, factor.information));
  state_->point_priors.push_back(factor);
}

void Smoother::add(const BiasedRelativePose& factor) {
  const RelativePose& motion = factor.motion;
  state_->smoother.add(turning(state_->name(motion.a), state_->name(motion.b),
                               state_->name(factor.bias), motion.a_T_b, factor.seconds,
                               motion.information));
  state_->biased_relative_poses.push_back(factor);
}

void Smoother::add(const ScalarPrior& factor) {
  state_->smoother.add(prior(state_->name(factor.scalar), factor.mean, factor.information));
  state_->scalar_priors.push_back(factor);
}

void Smoother::add(const ScalarStep& factor) {
  state_->smoother.add(step(state_->name(factor.a), state_->name(factor.b), factor.information));
  state_->scalar_steps.push_back(factor);
}

ObservationId Smoother::add(const PointObservation& factor) {
  state_->observations.push_back({factor, state_->give(factor)});
  return ObservationId(static_cast<std::uint32_t>(state_->observations.size() - 1));
}

void Smoother::set(ObservationId id, const PointObservation& factor) {
  State::Observation& observation = state_->observations[index(id)];
  state_->changes.push_back({index(id), observation});
  if (observation.factor != kNoFactor) state_->smoother.remove(observation.factor);
  observation = {factor, state_->give(factor)};
}

geometry::SE2 Smoother::pose(PoseId id) const { return state_->smoother.pose2(state_->name(id)); }
Eigen::Vector2d Smoother::point(PointId id) const {
  return state_->smoother.point2(state_->name(id));
}
double Smoother::scalar(ScalarId id) const {
  return state_->smoother.graph().value(state_->name(id))[0];
}
const PointObservation& Smoother::observation(ObservationId id) const {
  return state_->observations[index(id)].measured;
}

double Smoother::chi2(ObservationId id) const {
  const graph::FactorId factor = state_->observations[index(id)].factor;
  return factor == kNoFactor ? 0.0 : state_->smoother.graph().chi2(factor);
}

const std::vector<PointId>& Smoother::moved_points() const { return state_->moved_points; }
const std::vector<PoseId>& Smoother::moved_poses() const { return state_->moved_poses; }

Graph Smoother::graph() const {
  Graph graph;
  for (const graph::VariableId name : state_->poses)
    graph.poses.push_back(state_->smoother.pose2(name));
  for (const graph::VariableId name : state_->points) {
    graph.points.push_back(state_->smoother.point2(name));
  }
  graph.pose_priors = state_->pose_priors;
  graph.relative_poses = state_->relative_poses;
  graph.point_priors = state_->point_priors;
  for (const graph::VariableId name : state_->scalars) {
    graph.scalars.push_back(state_->smoother.graph().value(name)[0]);
  }
  graph.biased_relative_poses = state_->biased_relative_poses;
  graph.scalar_priors = state_->scalar_priors;
  graph.scalar_steps = state_->scalar_steps;
  for (const State::Observation& one : state_->observations) {
    graph.observations.push_back(one.measured);
  }
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

void Smoother::checkpoint() {
  state_->smoother.checkpoint();
  state_->forget_moved();
  state_->saved = state_->counts();
  state_->changes.clear();
}

void Smoother::rollback() {
  State& state = *state_;
  state.forget_moved();
  state.smoother.rollback();
  for (std::size_t i = state.changes.size(); i-- > 0;) {
    state.observations[state.changes[i].at] = state.changes[i].before;
  }
  state.changes.clear();
  state.poses.resize(state.saved.poses);
  state.points.resize(state.saved.points);
  state.observations.resize(state.saved.observations);
  state.pose_priors.resize(state.saved.pose_priors);
  state.relative_poses.resize(state.saved.relative_poses);
  state.point_priors.resize(state.saved.point_priors);
  state.scalars.resize(state.saved.scalars);
  state.biased_relative_poses.resize(state.saved.biased_relative_poses);
  state.scalar_priors.resize(state.saved.scalar_priors);
  state.scalar_steps.resize(state.saved.scalar_steps);
}

SmootherUpdate Smoother::update() {
  const bayes_tree::IncrementalUpdate update = state_->smoother.update();
  state_->collect_moved();
  return {update.ok, update.error};
}

std::optional<Eigen::MatrixXd> Smoother::joint_marginal(std::span<const PoseId> poses,
                                                        std::span<const PointId> points) const {
  std::vector<graph::VariableId> names;
  for (const PoseId id : poses) names.push_back(state_->name(id));
  for (const PointId id : points) names.push_back(state_->name(id));
  return state_->smoother.joint_covariance(names);
}

}  // namespace understory::factor_graph::plane
