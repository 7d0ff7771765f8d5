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

/// Where poses are in the frame of the first of them, measured together.
struct CondensedPoses {
  std::vector<PoseId> poses;                 ///< At least two.
  std::vector<geometry::SE2> first_T_other;  ///< Of poses[1..].
  /// Of first_T_other, side by side: right perturbations, x, y, theta each [m, rad].
  Eigen::MatrixXd information;
};

/// What an update found.
struct SmootherUpdate {
  bool ok = false;    ///< False: variables are undetermined and stay where they are.
  std::string error;  ///< Names the variables that the measurements leave undetermined.
};

/// Covariances of single variables.
struct Marginals {
  std::vector<Eigen::Matrix3d> poses;   ///< m, rad; right perturbation.
  std::vector<Eigen::Matrix2d> points;  ///< [m^2]
};

/// Index of a PointObservation in the order in which they were added.
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

/// Keeps a graph and its least-squares solution; the incremental smoother does the work. An update
/// and a rollback cost what changed. Factors must name variables of this smoother; see
/// graph::FactorGraph::add() for what throws.
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
  /// A new estimate of a variable that no factor names: so its number serves another one, and a
  /// graph whose variables come and go does not grow. Throws std::invalid_argument where a factor
  /// names it.
  void restart(PoseId id, const geometry::SE2& initial);
  /// Likewise.
  void restart(PointId id, const Eigen::Vector2d& initial);
  /// Likewise.
  void restart(ScalarId id, double initial);

  /// Takes a pose that no factor names out of what is solved: it keeps its number and its estimate,
  /// and takes 32 bytes. Nothing but pose() and unpark() may be asked of it until it is back;
  /// marginals have nothing of it. Throws std::invalid_argument where a factor names it, or where
  /// it is parked.
  void park(PoseId id);
  /// Puts it back. Throws std::invalid_argument where it is not parked.
  void unpark(PoseId id);

  /// Whether no factor names the point.
  bool is_free(PointId id) const;

  /// Adds a measured pose.
  void add(const PosePrior& factor);
  /// Adds a measured point.
  void add(const PointPrior& factor);
  /// Adds a measured motion. This and the following do not count where their information is zero.
  MotionId add(const RelativePose& factor);
  /// Adds a motion measured with a bias.
  BiasedMotionId add(const BiasedRelativePose& factor);
  /// Adds a measured scalar.
  ScalarPriorId add(const ScalarPrior& factor);
  /// Adds the drift of a scalar.
  ScalarStepId add(const ScalarStep& factor);
  /// Adds an observation.
  ObservationId add(const PointObservation& factor);
  /// Replaces a measurement by another one, of the same variables or of others.
  void set(MotionId id, const RelativePose& factor);
  /// Likewise.
  void set(BiasedMotionId id, const BiasedRelativePose& factor);
  /// Likewise.
  void set(ScalarPriorId id, const ScalarPrior& factor);
  /// Likewise.
  void set(ScalarStepId id, const ScalarStep& factor);
  /// Likewise.
  void set(ObservationId id, const PointObservation& factor);

  /// Holds this pose where it is said to be, to a micrometre and a microradian, in the place of the
  /// one that was held before: the gauge. It is not in graph().
  void hold(PoseId id, const geometry::SE2& mean);
  /// Puts these measurements in the place of those that were set before. They are not in graph().
  void set_condensed(std::span<const CondensedPoses> measured);

  /// The measurement as it was given last.
  const RelativePose& motion(MotionId id) const;
  /// Likewise.
  const BiasedRelativePose& motion(BiasedMotionId id) const;
  /// Likewise.
  const ScalarPrior& prior(ScalarPriorId id) const;
  /// Likewise.
  const ScalarStep& step(ScalarStepId id) const;
  /// Likewise.
  const PointObservation& observation(ObservationId id) const;

  /// Estimate of a pose.
  geometry::SE2 pose(PoseId id) const;
  /// Estimate of a point [m].
  Eigen::Vector2d point(PointId id) const;
  /// Estimate of a scalar.
  double scalar(ScalarId id) const;
  /// Squared whitened residual of an observation at the estimates; 0 where it does not count.
  double chi2(ObservationId id) const;
  /// Points that updates moved since the checkpoint, each once.
  const std::vector<PointId>& moved_points() const;
  /// Poses that updates moved since the checkpoint, each once.
  const std::vector<PoseId>& moved_poses() const;

  /// Everything that was given, at the present estimates. O(graph).
  Graph graph() const;
  /// Adds all of a graph; the smoother must be empty.
  void start_from(const Graph& graph);

  /// Remembers the state as it is.
  void checkpoint();
  /// Restores the state of the last checkpoint(), exactly.
  void rollback();

  /// The next measurements will be of this pose and of what was observed from it, whatever else is
  /// changed meanwhile: an update costs less where that is so.
  void expect_changes_at(PoseId id);
  /// Brings the estimates up to date. Variables without any factor are left alone.
  SmootherUpdate update();

  /// Joint covariance of poses (3 each, right perturbation), then points (2 each); none where a
  /// variable has no factor or is not determined.
  std::optional<Eigen::MatrixXd> joint_marginal(std::span<const PoseId> poses,
                                                std::span<const PointId> points) const;
  /// Covariances of poses (right perturbation) and of points, each by itself and in the order
  /// given; zero where joint_marginal() has none. Costs one elimination of the paths to the root,
  /// of all variables about one factorisation: for one or two joint_marginal() is cheaper.
  Marginals marginals(std::span<const PoseId> poses, std::span<const PointId> points) const;
  /// Variance of a scalar; none likewise.
  std::optional<double> variance(ScalarId id) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace understory::factor_graph::plane
