// The smoother of the mapper: poses and points of the plane, and what instruments are off by.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/factor_graph/plane/graph.hpp"

namespace understory::factor_graph::plane {

struct SmootherParameters {
  /// What moves by less of its own conditional standard deviation stays where it is [sigmas]. At
  /// 1e-2 one keyframe of twenty was refused on roads.
  double least_move = 1e-3;
  /// Far from where an update took place, changes of less than so many times that wait for their
  /// turn, which so many cliques have in an update: its cost does not follow the map.
  double wait_below = 100.0;
  int waiting_slots = 100;  ///< Number of waiting cliques that an update serves.
  /// A measurement is linearised again beyond this [sigmas]. Linearisations of different age leave
  /// torques that turn all that hangs on them: the prior that holds the map must hold it firmly,
  /// and at 1e-2 the end of a 5 km road swung by 2 m from update to update.
  double relinearise_above = 1e-2;
  /// An update goes on while one is this far from its linearisation [sigmas].
  double iterate_above = 0.1;
  int max_iterations = 8;
};

struct SmootherUpdate {
  bool ok = false;
  std::string error;  ///< Names the variables that the measurements leave undetermined.
};

/// Index of a PointObservation in the order in which they were added.
enum class ObservationId : std::uint32_t {};
constexpr std::uint32_t index(ObservationId id) { return static_cast<std::uint32_t>(id); }

/// Keeps a graph and its least-squares solution; the incremental smoother does the work. An update
/// and a rollback cost what changed.
class Smoother {
 public:
  explicit Smoother(const SmootherParameters& parameters = {});
  ~Smoother();
  Smoother(Smoother&&) noexcept;
  Smoother& operator=(Smoother&&) noexcept;

  PoseId add_pose(const geometry::SE2& initial);
  PointId add_point(const Eigen::Vector2d& initial);
  ScalarId add_scalar(double initial);
  void add(const PosePrior& factor);
  void add(const RelativePose& factor);
  void add(const PointPrior& factor);
  void add(const BiasedRelativePose& factor);
  void add(const ScalarPrior& factor);
  void add(const ScalarStep& factor);
  ObservationId add(const PointObservation& factor);
  /// Replaces a measurement; one whose information is zero no longer counts.
  void set(ObservationId id, const PointObservation& factor);

  geometry::SE2 pose(PoseId id) const;
  Eigen::Vector2d point(PointId id) const;
  double scalar(ScalarId id) const;
  const PointObservation& observation(ObservationId id) const;
  double chi2(ObservationId id) const;
  /// What updates moved since the checkpoint, each once.
  const std::vector<PointId>& moved_points() const;
  const std::vector<PoseId>& moved_poses() const;

  /// Everything that was given, at the present estimates; and from there. O(graph).
  Graph graph() const;
  void start_from(const Graph& graph);

  /// Remembers the state as it is; rollback() restores exactly that.
  void checkpoint();
  void rollback();

  /// Variables without any factor are left alone.
  SmootherUpdate update();

  /// Joint covariance of poses (3 each, right perturbation), then points (2 each); none where a
  /// variable has no factor or is not determined.
  std::optional<Eigen::MatrixXd> joint_marginal(std::span<const PoseId> poses,
                                                std::span<const PointId> points) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace understory::factor_graph::plane
