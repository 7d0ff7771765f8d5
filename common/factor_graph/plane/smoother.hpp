// The smoother of the mapper: poses and points of the plane, and biases of instruments.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "common/factor_graph/bayes_tree/incremental_parameters.hpp"
#include "common/factor_graph/plane/graph.hpp"

namespace understory::factor_graph::plane {

/// Joint measurement of poses in the frame of the first of them.
struct CondensedPoses {
  std::vector<PoseId> poses;                 ///< At least two.
  std::vector<geometry::SE2> first_T_other;  ///< Poses[1..] in the frame of poses[0].
  /// Joint information on first_T_other: right perturbations, x, y, theta each [m, rad].
  Eigen::MatrixXd information;
};

/// Result of an update.
struct SmootherUpdate {
  bool ok = false;    ///< False: variables are undetermined and stay where they are.
  std::string error;  ///< Message with the variables that the measurements do not determine.
};

/// Covariances of single variables.
struct Marginals {
  std::vector<Eigen::Matrix3d> poses;   ///< m, rad; right perturbation.
  std::vector<Eigen::Matrix2d> points;  ///< [m^2]
};

/// Index of a PointObservation in the order of adding.
enum class ObservationId : std::uint32_t {};
/// Index of a RelativePose, likewise.
enum class MotionId : std::uint32_t {};
/// Index of a BiasedRelativePose, likewise.
enum class BiasedMotionId : std::uint32_t {};
/// Index of a ScalarPrior, likewise.
enum class ScalarPriorId : std::uint32_t {};
/// Index of a ScalarStep, likewise.
enum class ScalarStepId : std::uint32_t {};
/// The index itself.
template <typename Id>
requires std::is_enum_v<Id>
constexpr std::uint32_t index(Id id) { return static_cast<std::uint32_t>(id); }

/// A graph and its least-squares solution, computed by the incremental smoother. Updates and
/// rollbacks cost the changes. Factors must refer to variables of this smoother; see
/// graph::FactorGraph::add() for exceptions.
///
/// More than 20 functions because it is a facade: half of them are overloads and accessors.
class Smoother {
 public:
  explicit Smoother(const bayes_tree::IncrementalParameters& parameters = {});
  ~Smoother();
  Smoother(Smoother&&) noexcept;
  Smoother& operator=(Smoother&&) noexcept;

  /// Adds a pose at this estimate.
  PoseId add_pose(const geometry::SE2& initial);
  /// Adds a point at this estimate [m].
  PointId add_point(const Eigen::Vector2d& initial);
  /// Adds a scalar at this estimate.
  ScalarId add_scalar(double initial);
  /// Gives a variable without factors a new estimate, so that its number serves for a new variable
  /// and the graph does not grow. Throws std::invalid_argument where it has a factor.
  void restart(PoseId id, const geometry::SE2& initial);
  /// The same for a point.
  void restart(PointId id, const Eigen::Vector2d& initial);
  /// The same for a scalar.
  void restart(ScalarId id, double initial);

  /// Removes a pose without factors from the system: it keeps its number and its estimate, and
  /// needs 32 bytes. Only pose() and unpark() are allowed for it until unpark(); marginals do not
  /// include it. Throws std::invalid_argument where it has a factor or is parked.
  void park(PoseId id);
  /// Returns a parked pose to the system. Throws std::invalid_argument where it is not parked.
  void unpark(PoseId id);

  /// Whether the point has no factor.
  bool is_free(PointId id) const;

  /// Adds a measured pose.
  void add(const PosePrior& factor);
  /// Adds a measured point.
  void add(const PointPrior& factor);
  /// Adds a measured motion. This and the following are ignored where their information is zero.
  MotionId add(const RelativePose& factor);
  /// Adds a motion measured with a bias.
  BiasedMotionId add(const BiasedRelativePose& factor);
  /// Adds a measured scalar.
  ScalarPriorId add(const ScalarPrior& factor);
  /// Adds the drift of a scalar.
  ScalarStepId add(const ScalarStep& factor);
  /// Adds an observation.
  ObservationId add(const PointObservation& factor);
  /// Replaces a measurement by another one, on the same variables or others.
  void set(MotionId id, const RelativePose& factor);
  /// The same for a motion with a bias.
  void set(BiasedMotionId id, const BiasedRelativePose& factor);
  /// The same for a prior on a scalar.
  void set(ScalarPriorId id, const ScalarPrior& factor);
  /// The same for the drift of a scalar.
  void set(ScalarStepId id, const ScalarStep& factor);
  /// The same for an observation.
  void set(ObservationId id, const PointObservation& factor);

  /// Fixes the gauge: holds this pose at `mean` to a micrometre and a microradian, and releases the
  /// pose held before. This prior is not in graph().
  void hold(PoseId id, const geometry::SE2& mean);
  /// Replaces all condensed measurements set before. They are not in graph().
  void set_condensed(std::span<const CondensedPoses> measured);

  /// The latest value of the measurement.
  const RelativePose& motion(MotionId id) const;
  /// The latest value of the measurement.
  const BiasedRelativePose& motion(BiasedMotionId id) const;
  /// The latest value of the measurement.
  const ScalarPrior& prior(ScalarPriorId id) const;
  /// The latest value of the measurement.
  const ScalarStep& step(ScalarStepId id) const;
  /// The latest value of the measurement.
  const PointObservation& observation(ObservationId id) const;

  /// Estimate of a pose.
  geometry::SE2 pose(PoseId id) const;
  /// Estimate of a point [m].
  Eigen::Vector2d point(PointId id) const;
  /// Estimate of a scalar.
  double scalar(ScalarId id) const;
  /// Squared whitened residual of an observation at the estimates; 0 where its information is zero.
  double chi2(ObservationId id) const;
  /// Points that updates moved since the checkpoint, each once.
  const std::vector<PointId>& moved_points() const;
  /// Poses that updates moved since the checkpoint, each once.
  const std::vector<PoseId>& moved_poses() const;

  /// All variables and measurements, at the present estimates. O(graph).
  Graph graph() const;
  /// Adds all of a graph; the smoother must be empty.
  void start_from(const Graph& graph);

  /// Saves the present state for rollback().
  void checkpoint();
  /// Restores the state of the last checkpoint(), exactly.
  void rollback();

  /// Announces that the next measurements affect this pose and the points observed from it,
  /// whatever else changes meanwhile. If so, the next update costs less.
  void expect_changes_at(PoseId id);
  /// Updates the estimates. Variables without factors stay.
  SmootherUpdate update();

  /// Joint covariance of poses (3 each, right perturbation), then points (2 each); none where a
  /// variable has no factor or is not determined.
  std::optional<Eigen::MatrixXd> joint_marginal(std::span<const PoseId> poses,
                                                std::span<const PointId> points) const;
  /// Covariances of poses (right perturbation) and of points, each alone, in the order given; zero
  /// where joint_marginal() has none. Costs one elimination of the paths to the root, of all
  /// variables about one factorisation: for one or two joint_marginal() is cheaper.
  Marginals marginals(std::span<const PoseId> poses, std::span<const PointId> points) const;
  /// Variance of a scalar; none where it has no factor or is not determined.
  std::optional<double> variance(ScalarId id) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace understory::factor_graph::plane
