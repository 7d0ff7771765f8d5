// The graph of keyframe centres and landmarks, with checkpoint and rollback.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/factor_graph/plane/archive.hpp"
#include "common/factor_graph/plane/condense.hpp"
#include "common/factor_graph/plane/smoother.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/centre_motion.hpp"
#include "services/geoslam_mapper/smoothing/free_numbers.hpp"
#include "services/geoslam_mapper/smoothing/frozen_motions.hpp"
#include "services/geoslam_mapper/smoothing/frozen_part.hpp"
#include "services/geoslam_mapper/smoothing/fused_motion.hpp"
#include "services/geoslam_mapper/smoothing/graph_values.hpp"
#include "services/geoslam_mapper/smoothing/gyro_bias.hpp"
#include "services/geoslam_mapper/smoothing/node.hpp"
#include "services/geoslam_mapper/smoothing/node_set.hpp"

namespace understory::geoslam_mapper::smoothing {

struct LooseGraph;

/// Nodes and landmarks as variables, their measurements as factors, solved incrementally. Numbers
/// of nodes are those of the smoother's poses; a new node may get the number of a removed one. This
/// class contains everything that a refused keyframe may have changed: rollback() restores it
/// exactly. Frame: `map`.
///
/// More than 20 functions because it is the mapper's view of the smoother: a third are accessors.
class PoseGraph {
 public:
  /// An empty graph.
  explicit PoseGraph(const SmoothingMapperParameters& parameters);

  /// Saves the state.
  void checkpoint();
  /// Restores exactly the state of the last checkpoint(). Cost: the changes.
  void rollback();

  /// Adds a node at an initial guess of its pose. A fixed node is held there, to a micrometre: it
  /// carries the origin of the map.
  NodeIndex add_node(const geometry::SE2& map_T_centre, bool is_stationary, bool is_fixed = false);
  /// Adds a landmark at an initial guess of its position, with a prior [m^2] if it was given.
  void add_landmark(model::LandmarkId id, const Eigen::Vector2d& position_m,
                    const std::optional<Eigen::Matrix2d>& prior_covariance_m2);
  /// Adds an observation: position [m] in the node's frame with its information [1/m^2]. A further
  /// one of the same landmark from the same node is averaged with the first, weighted by
  /// information.
  void observe(NodeIndex node, model::LandmarkId id, const Eigen::Vector2d& position_m,
               const Eigen::Matrix2d& information);
  /// Removes an observation.
  void ignore(NodeIndex node, model::LandmarkId id);
  /// Merges two landmarks: the observations of `old_id` from `nodes` become those of `new_id`. They
  /// are ignored at nodes that observed both.
  std::vector<HandedOver> hand_over(model::LandmarkId old_id, model::LandmarkId new_id,
                                    std::span<const NodeIndex> nodes);
  /// Returns those observations of `from_id` that are unchanged since to a landmark of the graph;
  /// gives their nodes.
  std::vector<NodeIndex> give_back(model::LandmarkId from_id, model::LandmarkId to_id,
                                   std::span<const HandedOver> handed_over);
  /// Adds the motion from an earlier node; nothing if it is the same node.
  void add_motion(const CentreMotion& motion, NodeIndex node);

  /// Adds a loop closure between two nodes. Its number must be new.
  void add_closure(std::uint64_t id, NodeIndex a, NodeIndex b,
                   const geometry::SE2WithCovariance& a_T_b);
  /// Removes a closure; it must exist. If an end of it is frozen, all frozen nodes return to the
  /// solved graph.
  void take_closure_out(std::uint64_t id);
  /// Whether the closure is in the graph. It is not if it was removed with a node.
  bool has_closure(std::uint64_t id) const;
  /// chi^2 (3 degrees of freedom) of a closure at the present estimate; it must exist.
  double closure_chi2(std::uint64_t id) const;

  /// Share of the information to keep, as a function of the path length [m].
  using ShareAlong = std::function<double(double along_m)>;
  /// Scales the information of all measurements on the path between two nodes, since errors there
  /// are larger than stated. Closures keep theirs. The inverse shares undo it, except for rounding.
  /// Cost: the measurements of that path.
  void relax(NodeIndex a, NodeIndex b, const ShareAlong& share_at);

  /// Removes nodes and motions. The nodes' observations become observations of other nodes; the
  /// frames of the two agree to within the covariance of `into_T_node`. Motions that begin or end
  /// at the nodes are lost; one to a later node that stays then begins at the other node. None of
  /// the other nodes may be removed, too, nor the newest one. Cost: the factors of the nodes.
  void take_out(const Surplus& surplus);

  /// Nodes as a separate graph, with the numbers that they have here. Poses: `inner`, then `outer`.
  struct Part {
    /// A motion to another node.
    struct Outer {
      NodeIndex node = 0;
      NodeIndex inner = 0;  ///< Its end in the part.
      MotionRef motion;
    };
    factor_graph::plane::Graph graph;
    std::vector<NodeIndex> inner;
    std::vector<Outer> outer;
    std::vector<model::LandmarkId> landmarks;
    std::vector<factor_graph::plane::ScalarId> scalars;  ///< May repeat.
  };
  /// These nodes with their observations and motions, also to other nodes. Cost: their factors.
  Part part_of(std::span<const NodeIndex> nodes) const;
  /// Replaces these nodes, all of which must exist, by one node: their observations and motions
  /// become one condensed measurement (plane::condense). The newest node and the one that holds the
  /// map must not be among them. The retirements give the pose of each node relative to the new
  /// one; empty and without change if the nodes' own factors leave a node undetermined. Cost: the
  /// factors of the nodes, and condense_ahead() if it was not called.
  std::vector<Retirement> condense(std::span<const NodeIndex> nodes);
  /// Computes the condensed measurement of these nodes in advance; condense() uses it if neither
  /// they nor any estimate has changed by then. It has no other effect. Cost: cubic in the nodes,
  /// linear in their factors.
  void condense_ahead(std::span<const NodeIndex> nodes);

  /// Removes landmarks from the solved graph: their information on the nodes that observed them,
  /// all of which must be condensed, becomes motions between these nodes. Exact, except for the
  /// linearisation, if two nodes observed a landmark or informations are isotropic, else a little
  /// information is lost; wake() undoes it. Landmarks with a prior must not be among them. Cost:
  /// the landmarks that the nodes have in common.
  void make_dormant(std::span<const model::LandmarkId> ids,
                    const std::map<model::LandmarkId, StoredLandmark>& landmarks);
  /// Moves dormant ones of these landmarks into the solved graph.
  void wake(std::span<const model::LandmarkId> ids);
  /// Removes dormant landmarks from the graph altogether. Their information on the nodes stays: one
  /// motion per pair of nodes, for all removed landmarks together. bring_back() undoes it, except
  /// for terms of second order. Throws std::out_of_range if one is not dormant. Cost: the
  /// landmarks, and those that their nodes have in common.
  AwayLandmarks put_away(std::span<const model::LandmarkId> ids);
  /// Makes them dormant landmarks of the graph again. Throws std::invalid_argument without change
  /// if an observation has no information or is from a node that is not condensed or is frozen, or
  /// if no motion represents them.
  void bring_back(std::span<const model::LandmarkId> ids, const AwayLandmarks& away);
  /// Motions between a node and others that are not frozen, including closures, with the present
  /// gyro bias; without the information of landmarks.
  std::vector<FrozenMotion> motions_of(NodeIndex node) const;
  /// Ids of a node's dormant landmarks.
  std::span<const model::LandmarkId> dormant_of(NodeIndex node) const;
  /// The node that observed a dormant landmark first. Throws std::out_of_range if it is not
  /// dormant.
  NodeIndex home_of(model::LandmarkId id) const { return dormant_.at(id).front().node; }
  /// Removes nodes from the solved graph: all their measurements become one condensed measurement
  /// of the nodes around them (frozen_part). They must be condensed and have only motions in the
  /// graph; others are skipped. False without change if the result would tie too many nodes. thaw()
  /// undoes it. Cost: one factorisation of these nodes, whatever the number of nodes frozen before.
  /// From then on another node holds the solved graph at its pose, so that linearisation errors of
  /// distant nodes do not move the map around the vehicle; the origin stays a variable, and
  /// covariances count from it.
  bool freeze(std::span<const NodeIndex> nodes);
  /// Moves frozen ones of these nodes into the solved graph again. False without change if none is
  /// frozen. Same cost.
  bool thaw(std::span<const NodeIndex> nodes);
  /// Moves all frozen nodes into the solved graph again and holds it at the origin of the map,
  /// before a join that may move all of them. Same cost.
  void unfreeze();
  /// The node that carries the origin of the map; none if the map was given.
  std::optional<NodeIndex> origin() const;
  /// Moves the node that carries the origin, and the whole map with it once the graph is solved.
  /// False without change if it does not hold the solved graph. Cost: the solved graph.
  bool move_origin(const Eigen::Vector2d& by_m);
  /// Marks a node as condensed: it receives no more observations. For the origin, which is in no
  /// stretch, once it is far behind.
  void close(NodeIndex node) { edit(node).is_condensed = true; }
  /// Whether the node is frozen (outside the solved graph).
  bool is_frozen(NodeIndex node) const { return frozen_.contains(node); }
  /// Number of frozen nodes.
  std::size_t frozen_count() const { return frozen_.size(); }
  /// Whether the landmark is dormant (outside the solved graph).
  bool is_dormant(model::LandmarkId id) const { return dormant_.contains(id); }
  /// Position of a dormant landmark [m] at the nodes' estimates. Throws std::out_of_range if it is
  /// not dormant.
  Eigen::Vector2d dormant_position(model::LandmarkId id) const;
  /// Ids of all landmarks in the solved graph, ascending. O(landmarks in it).
  std::vector<model::LandmarkId> awake() const;

  /// All measurements, for another graph to absorb. O(graph).
  LooseGraph loosened();
  /// Adds all of another graph, moved to `map_T_other`; its path lengths count from `further_m`
  /// [m]. Its fixed node is no longer held: a measurement between the two graphs must be added
  /// before they are solved. Returns the number of its first node: the others follow. Cost: the
  /// other graph.
  NodeIndex absorb(const LooseGraph& other, const geometry::SE2& map_T_other, double further_m);

  /// Updates the estimates. Not `ok` if the measurements leave variables undetermined.
  factor_graph::plane::SmootherUpdate solve();

  /// A node of the graph. Throws std::out_of_range if there is none.
  const Node& node(NodeIndex node) const { return nodes_.at(node); }
  /// The node that was added last; none before the first.
  std::optional<NodeIndex> newest() const { return newest_; }
  /// Number of nodes.
  std::size_t node_count() const { return nodes_.size() - free_nodes_.size(); }
  /// map_T_centre of a node.
  geometry::SE2 pose(NodeIndex node) const { return smoother_.pose(nodes_[node].centre); }
  /// Largest move of a node [m] before its dormant landmarks are moved with it.
  static constexpr double kDormantMove_m = 0.05;

  /// Position of a landmark [m]; none while it is not in the graph.
  std::optional<Eigen::Vector2d> position(model::LandmarkId id) const;
  /// chi^2 (2 degrees of freedom) of one observation at the present estimate.
  double chi2(NodeIndex node, model::LandmarkId id) const;
  /// One observation: its position in the node's frame and its information.
  const factor_graph::plane::PointObservation& observation(NodeIndex node,
                                                           model::LandmarkId id) const {
    return smoother_.observation(nodes_[node].observations().at(id));
  }
  /// map_T_centre with its marginal covariance (right perturbation), zero if it is undetermined.
  geometry::SE2WithCovariance marginal(NodeIndex node) const;
  /// a_T_b with its covariance (right perturbation); none if it is undetermined.
  std::optional<geometry::SE2WithCovariance> relative(NodeIndex a, NodeIndex b) const;
  /// Variances [m^2] of landmarks of the graph relative to a node, per axis. Empty if a variable is
  /// undetermined.
  std::vector<double> relative_variances(NodeIndex node,
                                         std::span<const model::LandmarkId> ids) const;
  /// Covariances [m^2] of landmarks' positions, frame `map`; zero if a landmark is undetermined or
  /// not in the solved graph. Cost: one elimination of the paths to the root.
  std::vector<Eigen::Matrix2d> covariances(std::span<const model::LandmarkId> ids) const;
  /// Covariances of map_T_centre of nodes, which may repeat (right perturbation); zero likewise.
  std::vector<Eigen::Matrix3d> covariances(std::span<const NodeIndex> nodes) const;
  /// Covariance [m^2] of the difference of two landmarks' positions, frame `map`; none if it is
  /// undetermined.
  std::optional<Eigen::Matrix2d> difference_covariance(model::LandmarkId a,
                                                       model::LandmarkId b) const;
  /// Landmarks that updates moved since the checkpoint, with their positions [m], each once.
  /// Dormant ones are included if one of their nodes has moved by kDormantMove_m since they last
  /// followed it.
  std::vector<std::pair<model::LandmarkId, Eigen::Vector2d>> take_moved_landmarks();
  /// Nodes that updates moved since the checkpoint, each once.
  std::vector<NodeIndex> moved_nodes() const;

  /// Members of a saved state; see common/state. The graph is stored at its estimates and is
  /// linearised anew after a load. A checkpoint exists only during the fusion of a keyframe.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    factor_graph::plane::Graph graph = self.smoother_.graph();
    a(graph, self.nodes_, self.landmark_of_point_, self.gyro_, self.newest_, self.free_nodes_,
      self.free_points_, self.free_observations_, self.free_motions_, self.free_biased_,
      self.dormant_, self.ties_, self.closures_, self.frozen_motions_, self.origin_, self.anchor_);
    const std::set<NodeIndex> all = self.frozen_.all();
    std::vector<NodeIndex> frozen(all.begin(), all.end());
    a(frozen);
    if constexpr (Archive::kReads)
      for (const NodeIndex node : frozen) self.frozen_.insert(node);
    if constexpr (Archive::kReads) self.restore(graph);
  }

 private:
  struct Checkpoint {
    std::size_t nodes = 0;
    std::size_t points = 0;
    std::optional<NodeIndex> newest;
    std::map<NodeIndex, Node> changed;  ///< Previous values of changed nodes.
    std::map<std::uint32_t, std::uint64_t> closures;
    std::optional<Anchor> origin;
    std::optional<Anchor> anchor;
    std::vector<factor_graph::plane::PointId> restarted;  ///< Points that got a landmark again.
    /// Points whose landmark was merged into another one.
    std::vector<std::pair<factor_graph::plane::PointId, model::LandmarkId>> dropped;
  };
  bool is_within(NodeIndex node, double from_m, double to_m) const;
  void scale_information(MotionRef ref, double share);
  void relax_dormant(double from_m, double to_m, const ShareAlong& share_at);
  double middle_m(NodeIndex a, NodeIndex b) const;
  Node& edit(NodeIndex node);
  void forget_ahead_of(NodeIndex node);
  NodeIndex put_node(const geometry::SE2& map_T_centre, bool is_stationary, double along_m);
  /// A pair of nodes, smaller number first.
  using TiedNodes = std::pair<NodeIndex, NodeIndex>;
  /// The landmarks outside the solved graph that two nodes observed, as one motion between the
  /// nodes: the dormant ones and the stored ones. A landmark changes from one kind to the other
  /// without a change of the motion.
  struct Tie {
    std::optional<factor_graph::plane::MotionId> motion;
    std::vector<model::LandmarkId> landmarks;  ///< The dormant ones.
    MeasuredMotion away;                       ///< Motion for the stored ones, of ...
    std::uint32_t submaps = 0;                 ///< ... parts of this number of submaps.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.motion, s.landmarks, s.submaps);
      if (s.submaps > 0) a(s.away);
    }
  };
  std::vector<TiedNodes> tied_by(model::LandmarkId id) const;
  void renew(const std::set<TiedNodes>& ties);
  factor_graph::plane::MotionId put(const factor_graph::plane::RelativePose& motion);
  void take_out(factor_graph::plane::MotionId motion);
  void add_away(const FrozenMotion& motion);
  void take_away_out(const FrozenMotion& motion);
  bool may_freeze(NodeIndex node) const;
  void hold(const Anchor& anchor);
  std::optional<Anchor> anchor_beyond(const std::set<NodeIndex>& going) const;
  /// Then the origin is an ordinary variable.
  bool is_held_elsewhere() const { return origin_ && anchor_->node != origin_->node; }
  Eigen::Matrix3d anchor_covariance() const;
  Eigen::Matrix3d of_anchor(const geometry::SE2& map_T_node, const Eigen::Matrix3d& anchor) const;
  Eigen::Matrix2d of_anchor(const Eigen::Vector2d& position_m, const Eigen::Matrix3d& anchor) const;
  std::vector<FrozenMotion> motions_around(const std::set<NodeIndex>& nodes) const;
  void take_motions_out(const std::set<NodeIndex>& nodes);
  void give_back(std::span<const FrozenMotion> motions);
  void release(NodeIndex node);
  std::optional<std::vector<FrozenFactor>> condense_parts(
      const std::vector<FrozenPart>& parts) const;
  void set_frozen_factors();
  void recondense_frozen();
  FrozenMotion loose_motion(MotionRef ref) const;
  static FrozenMotion away_motion(const TiedNodes& nodes, const Tie& tie);
  std::vector<FrozenMotion> loose_motions() const;
  void absorb(const FrozenMotion& motion, NodeIndex first);
  factor_graph::plane::RelativePose tie(const TiedNodes& nodes,
                                        std::span<const model::LandmarkId> ids) const;
  void wakes(NodeIndex node, model::LandmarkId id);
  bool has_left(NodeIndex node);
  void add_motions_of(NodeIndex node, Part& part) const;
  void add_motion(MotionRef ref, factor_graph::plane::PoseId a, factor_graph::plane::PoseId b,
                  Part& part) const;
  bool leads_away(NodeIndex node, NodeIndex from, NodeIndex to, const Surplus& surplus) const;
  bool leads_in(NodeIndex node, NodeIndex from, NodeIndex to, const Surplus& surplus) const;
  void end_motion_at(const Retirement& retirement, NodeIndex from,
                     const factor_graph::plane::RelativePose& measured);
  void begin_motion_at(NodeIndex into, const Part::Outer& outer,
                       const factor_graph::plane::CondensedMotion& condensed);
  void take_out(NodeIndex node);
  void restore(const factor_graph::plane::Graph& graph);
  void place_observation(NodeIndex node, model::LandmarkId id,
                         const factor_graph::plane::PointObservation& factor);
  MotionRef link(const factor_graph::plane::RelativePose& measured, NodeIndex from, NodeIndex to);
  std::uint32_t motion_of(std::uint64_t closure) const;
  void hand_observations_to(const Retirement& retirement);
  void take_motions_out(const Retirement& retirement, const Surplus& surplus);
  void take_motions_out(NodeIndex a, NodeIndex b);
  void loosen(NodeIndex node, const Surplus& surplus);
  std::pair<NodeIndex, NodeIndex> ends_of(MotionRef ref) const;
  void begin_motion_at(const Retirement& retirement, NodeIndex to,
                       const factor_graph::plane::RelativePose& measured);
  factor_graph::plane::RelativePose take_motion_out(MotionRef ref);

  factor_graph::plane::Smoother smoother_;
  std::deque<Node> nodes_;  ///< In blocks: a long drive has many nodes.
  std::unordered_map<model::LandmarkId, factor_graph::plane::PointId> point_of_;
  /// By point of the smoother; 0 if the landmark was merged into another.
  std::vector<model::LandmarkId> landmark_of_point_;
  GyroBias gyro_;
  std::map<model::LandmarkId, std::vector<DormantObservation>> dormant_;
  std::map<TiedNodes, Tie> ties_;                    ///< Without the frozen ones.
  std::map<std::uint32_t, std::uint64_t> closures_;  ///< Closures by the number of their motion.
  NodeSet frozen_;
  FrozenMotions frozen_motions_;              ///< With at least one frozen end.
  std::vector<FrozenFactor> frozen_factors_;  ///< In the solved graph; computed from the motions.
  /// A node's dormant landmarks, and the node's pose at their last update.
  struct DormantOfNode {
    std::vector<model::LandmarkId> landmarks;
    geometry::SE2 followed;
  };
  std::map<NodeIndex, DormantOfNode>
      dormant_of_node_;              ///< Only nodes that have any; computed from dormant_.
  std::optional<NodeIndex> newest_;  ///< Added last.
  std::optional<Anchor> origin_;     ///< At the first keyframe.
  std::optional<Anchor> anchor_;     ///< The node that holds the solved graph now.
  FreeNumbers free_nodes_;
  FreeNumbers free_points_;
  FreeNumbers free_observations_;
  FreeNumbers free_motions_;
  FreeNumbers free_biased_;
  /// Nodes to condense, and their condensed measurement. Computed from other members: not saved.
  struct CondensedAhead {
    Part part;
    factor_graph::plane::CondensedPart condensed;
  };
  std::optional<CondensedAhead> ahead_;
  std::optional<Checkpoint> before_;
};

}  // namespace understory::geoslam_mapper::smoothing
