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
/// of nodes are those of the smoother's poses; a new node may get the number of one that was taken
/// out. Everything that a refused keyframe may have changed is in here: rollback() takes it back
/// exactly. Frame: `map`.
///
/// More than 20 functions because it is the mapper's view of the smoother: a third are accessors.
class PoseGraph {
 public:
  /// An empty graph.
  explicit PoseGraph(const SmoothingMapperParameters& parameters);

  /// Remembers the state.
  void checkpoint();
  /// Restores exactly the state of the last checkpoint(). Costs what changed.
  void rollback();

  /// Adds a node at a first guess of its pose. A fixed one is held there, to a micrometre: it
  /// carries the origin of the map.
  NodeIndex add_node(const geometry::SE2& map_T_centre, bool is_stationary, bool is_fixed = false);
  /// Adds a landmark at a first guess of its position, with a prior [m^2] if it was given.
  void add_landmark(model::LandmarkId id, const Eigen::Vector2d& position_m,
                    const std::optional<Eigen::Matrix2d>& prior_covariance_m2);
  /// Adds an observation: position [m] in the node's frame with its information [1/m^2]. A further
  /// one of the same landmark from the same node is averaged into the first by information.
  void observe(NodeIndex node, model::LandmarkId id, const Eigen::Vector2d& position_m,
               const Eigen::Matrix2d& information);
  /// Takes an observation out.
  void ignore(NodeIndex node, model::LandmarkId id);
  /// Makes two landmarks one: the observations of `old_id` from `nodes` become those of `new_id`.
  /// They do not count where a node observed both.
  std::vector<HandedOver> hand_over(model::LandmarkId old_id, model::LandmarkId new_id,
                                    std::span<const NodeIndex> nodes);
  /// Gives observations of `from_id` back to a landmark that is in the graph, those that nothing
  /// was added to since; returns their nodes.
  std::vector<NodeIndex> give_back(model::LandmarkId from_id, model::LandmarkId to_id,
                                   std::span<const HandedOver> handed_over);
  /// Adds the motion from an earlier node; nothing if it is the same node.
  void add_motion(const CentreMotion& motion, NodeIndex node);

  /// Adds a loop closure between two nodes. Its number must be new.
  void add_closure(std::uint64_t id, NodeIndex a, NodeIndex b,
                   const geometry::SE2WithCovariance& a_T_b);
  /// Takes it out again; there must be one.
  void take_closure_out(std::uint64_t id);
  /// Whether it counts. It does no more where a node was taken out with which it went.
  bool has_closure(std::uint64_t id) const;
  /// chi^2 (3 degrees of freedom) of a closure at the present estimate; there must be one.
  double closure_chi2(std::uint64_t id) const;

  /// Share of the information that is kept, by the point of the path [m].
  using ShareAlong = std::function<double(double along_m)>;
  /// Scales the information of all measurements on the path between two nodes: errors there are
  /// larger than was stated. Closures keep theirs. The inverse shares undo it, but for rounding.
  /// Cost: the measurements of that path.
  void relax(NodeIndex a, NodeIndex b, const ShareAlong& share_at);

  /// Takes nodes and motions out. What the nodes observed becomes observations of other nodes, in
  /// whose frames the two agree to within the covariance of `into_T_node`. Motions that begin or
  /// end at the nodes are lost; one to a later node that stays begins at the other node then. None
  /// of the other nodes may be taken out, too, nor the newest one. Cost: the factors of the nodes.
  void take_out(const Surplus& surplus);

  /// Nodes as a graph of their own, and what its numbers are here. Poses: `inner`, then `outer`.
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
  /// What these nodes observed and how they moved, also to others. Cost: their factors.
  Part part_of(std::span<const NodeIndex> nodes) const;
  /// Puts one node in the place of these, all of which there are: what they observed and how they
  /// moved becomes one condensed measurement (plane::condense). The newest node and the one that
  /// holds the map must not be among them. The retirements tell where each node was relative to
  /// the new one; empty, and nothing changed, where their own factors leave a node undetermined.
  /// Cost: the factors of the nodes, and condense_ahead() where it was not called.
  std::vector<Retirement> condense(std::span<const NodeIndex> nodes);
  /// Computes what condense() of these nodes puts in their place, which it takes if neither they
  /// nor any estimate was changed by then. Nothing else depends on it. Cost: cubic in the nodes,
  /// linear in their factors.
  void condense_ahead(std::span<const NodeIndex> nodes);

  /// Takes landmarks out of the solved graph: what they measure of the nodes that observed them,
  /// all of which must be condensed, becomes motions between these. Exact but for the linearisation
  /// where two nodes observed a landmark or informations are isotropic, else a little less is kept;
  /// undone by wake(). Landmarks with a prior must not be among them. Cost: the landmarks that the
  /// nodes have in common.
  void make_dormant(std::span<const model::LandmarkId> ids,
                    const std::map<model::LandmarkId, StoredLandmark>& landmarks);
  /// Takes landmarks into the solved graph again, where they are dormant.
  void wake(std::span<const model::LandmarkId> ids);
  /// Takes dormant landmarks out of the graph altogether. What they measure of the nodes stays: one
  /// motion of each two nodes, whatever is away of them. bring_back() undoes it, but for terms of
  /// second order. Throws std::out_of_range where one is not dormant. Cost: the landmarks, and
  /// those that their nodes have in common.
  AwayLandmarks put_away(std::span<const model::LandmarkId> ids);
  /// Makes them dormant landmarks of the graph again. Throws std::invalid_argument where an
  /// observation is of a node that is not condensed or is frozen, or has no information, or where
  /// no motion stands for them; nothing is changed then.
  void bring_back(std::span<const model::LandmarkId> ids, const AwayLandmarks& away);
  /// How a node lies to others that are not frozen, closures among it, with the gyro's bias as it
  /// is known now; without what landmarks tell.
  std::vector<FrozenMotion> motions_of(NodeIndex node) const;
  /// Ids of a node's dormant landmarks.
  std::span<const model::LandmarkId> dormant_of(NodeIndex node) const;
  /// The node that observed a dormant landmark first. Throws std::out_of_range likewise.
  NodeIndex home_of(model::LandmarkId id) const { return dormant_.at(id).front().node; }
  /// Takes nodes out of the solved graph: all that was measured of them becomes one condensed
  /// measurement of the nodes around them (frozen_part). They must be condensed ones with nothing
  /// in the graph but motions; others among them are passed over. False, and nothing is changed,
  /// where what is left would be tied at too many nodes. Undone by thaw(). Cost: one factorisation
  /// of these nodes, however many were frozen before. Another node holds the solved graph from then
  /// on, where it is, so that what far linearisations leave does not move the ground around the
  /// vehicle; the origin stays as a variable, and covariances count from it.
  bool freeze(std::span<const NodeIndex> nodes);
  /// Takes nodes into the solved graph again, where they are frozen. False where none is, and
  /// nothing is changed. The same cost.
  bool thaw(std::span<const NodeIndex> nodes);
  /// Takes all frozen nodes into the solved graph again, and holds it at the origin of the map:
  /// what is to be joined with it may move all of them. The same cost.
  void unfreeze();
  /// The node that carries the origin of the map; none where the map was given.
  std::optional<NodeIndex> origin() const;
  /// Moves the node that carries the origin, and all with it once the graph is solved. False, and
  /// nothing is changed, where it does not hold the solved graph. Cost: the solved graph.
  bool move_origin(const Eigen::Vector2d& by_m);
  /// From now on the node counts as a condensed one: it gets nothing more. For the origin, which is
  /// in no stretch, once it is far behind.
  void close(NodeIndex node) { edit(node).is_condensed = true; }
  /// Whether the node is out of the solved graph.
  bool is_frozen(NodeIndex node) const { return frozen_.contains(node); }
  /// Number of nodes out of the solved graph.
  std::size_t frozen_count() const { return frozen_.size(); }
  /// Whether the landmark was taken out of the solved graph.
  bool is_dormant(model::LandmarkId id) const { return dormant_.contains(id); }
  /// Position of a dormant landmark [m] at the nodes' estimates. Throws std::out_of_range where it
  /// is not dormant.
  Eigen::Vector2d dormant_position(model::LandmarkId id) const;
  /// Ids of all landmarks in the solved graph, ascending. O(landmarks in it).
  std::vector<model::LandmarkId> awake() const;

  /// All that was measured, for another graph to absorb. O(graph).
  LooseGraph loosened();
  /// Adds all of another graph, moved to `map_T_other`; its paths count from `further_m` [m] on.
  /// What held it is not among it: a measurement between the two must follow before the graph is
  /// solved. Returns the number of its first node: the others follow. Cost: the other graph.
  NodeIndex absorb(const LooseGraph& other, const geometry::SE2& map_T_other, double further_m);

  /// Updates the estimates. Not `ok` where the measurements leave variables undetermined.
  factor_graph::plane::SmootherUpdate solve();

  /// A node of the graph. Throws std::out_of_range where there is none.
  const Node& node(NodeIndex node) const { return nodes_.at(node); }
  /// The node that was added last; none before the first.
  std::optional<NodeIndex> newest() const { return newest_; }
  /// Number of nodes.
  std::size_t node_count() const { return nodes_.size() - free_nodes_.size(); }
  /// map_T_centre of a node.
  geometry::SE2 pose(NodeIndex node) const { return smoother_.pose(nodes_[node].centre); }
  /// Largest move of a node [m] that its dormant landmarks do not follow at once.
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
  /// map_T_centre with its marginal covariance (right perturbation), zero where it is undetermined.
  geometry::SE2WithCovariance marginal(NodeIndex node) const;
  /// a_T_b with its covariance (right perturbation); none where it is undetermined.
  std::optional<geometry::SE2WithCovariance> relative(NodeIndex a, NodeIndex b) const;
  /// Variances [m^2] of landmarks of the graph relative to a node, per axis. Empty where a variable
  /// is undetermined.
  std::vector<double> relative_variances(NodeIndex node,
                                         std::span<const model::LandmarkId> ids) const;
  /// Covariances [m^2] of landmarks' positions, frame `map`; zero where a landmark is not in the
  /// solved graph or undetermined. Costs one elimination of the paths to the root.
  std::vector<Eigen::Matrix2d> covariances(std::span<const model::LandmarkId> ids) const;
  /// Covariances of map_T_centre of nodes, which may repeat (right perturbation); zero likewise.
  std::vector<Eigen::Matrix3d> covariances(std::span<const NodeIndex> nodes) const;
  /// Covariance [m^2] of the difference of two landmarks' positions, frame `map`; none where it is
  /// undetermined.
  std::optional<Eigen::Matrix2d> difference_covariance(model::LandmarkId a,
                                                       model::LandmarkId b) const;
  /// Landmarks that updates moved since the checkpoint, with their positions [m], each once.
  /// Dormant ones are among them where a node of theirs has moved by kDormantMove_m since they
  /// were.
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
    std::map<NodeIndex, Node> changed;  ///< Of those there were, as they were.
    std::map<std::uint32_t, std::uint64_t> closures;
    std::optional<Anchor> origin;
    std::optional<Anchor> anchor;
    std::vector<factor_graph::plane::PointId> restarted;  ///< Points with a landmark again.
    /// Points whose landmark was joined with another one.
    std::vector<std::pair<factor_graph::plane::PointId, model::LandmarkId>> dropped;
  };
  bool is_within(NodeIndex node, double from_m, double to_m) const;
  void scale_information(MotionRef ref, double share);
  void relax_dormant(double from_m, double to_m, const ShareAlong& share_at);
  double middle_m(NodeIndex a, NodeIndex b) const;
  Node& edit(NodeIndex node);
  void forget_ahead_of(NodeIndex node);
  NodeIndex put_node(const geometry::SE2& map_T_centre, bool is_stationary, double along_m);
  /// What two nodes have in common, smaller number first.
  using TiedNodes = std::pair<NodeIndex, NodeIndex>;
  /// The landmarks that two nodes observed and that are not solved, as one motion between the
  /// nodes: the dormant ones, and those that are kept elsewhere. One of those goes or comes from
  /// here to there without a change of the motion.
  struct Tie {
    std::optional<factor_graph::plane::MotionId> motion;
    std::vector<model::LandmarkId> landmarks;  ///< The dormant ones.
    MeasuredMotion away;                       ///< What stands for the others,
    std::uint32_t submaps = 0;                 ///< parts of so many submaps.

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
  /// The origin is a variable like others then.
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
  std::deque<Node> nodes_;  ///< By blocks: a long drive has many.
  std::unordered_map<model::LandmarkId, factor_graph::plane::PointId> point_of_;
  /// By point of the smoother; 0 where the landmark was merged into another.
  std::vector<model::LandmarkId> landmark_of_point_;
  GyroBias gyro_;
  std::map<model::LandmarkId, std::vector<DormantObservation>> dormant_;
  std::map<TiedNodes, Tie> ties_;                    ///< But for those that are frozen.
  std::map<std::uint32_t, std::uint64_t> closures_;  ///< Closures by the number of their motion.
  NodeSet frozen_;
  FrozenMotions frozen_motions_;              ///< With an end that is frozen.
  std::vector<FrozenFactor> frozen_factors_;  ///< In the solved graph; from the motions.
  /// What is dormant of a node's landmarks, and where the node was when they last followed it.
  struct DormantOfNode {
    std::vector<model::LandmarkId> landmarks;
    geometry::SE2 followed;
  };
  std::map<NodeIndex, DormantOfNode> dormant_of_node_;  ///< Where there are any; from dormant_.
  std::optional<NodeIndex> newest_;                     ///< Added last.
  std::optional<Anchor> origin_;                        ///< The first keyframe's.
  std::optional<Anchor> anchor_;                        ///< What holds the solved graph now.
  FreeNumbers free_nodes_;
  FreeNumbers free_points_;
  FreeNumbers free_observations_;
  FreeNumbers free_motions_;
  FreeNumbers free_biased_;
  /// Nodes that are to become one, and what they measure. From the rest: it is in no saved state.
  struct CondensedAhead {
    Part part;
    factor_graph::plane::CondensedPart condensed;
  };
  std::optional<CondensedAhead> ahead_;
  std::optional<Checkpoint> before_;
};

}  // namespace understory::geoslam_mapper::smoothing
