// Where every keyframe was, and which of them were at one place.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"
#include "services/geoslam_mapper/smoothing/viewpoint_grid.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A keyframe's base, rigidly tied to a node: nothing else measures it.
struct Base {
  NodeIndex node = 0;
  std::uint64_t sequence = 0;  ///< Of the keyframe.
  model::Utime utime = 0;
  geometry::SE2WithCovariance centre_T_base;  ///< In the node's frame.
  /// Mean of the keyframe's members, in the node's frame: the position of the keyframe, three times
  /// as exact as the base alone.
  geometry::SE2 centre_T_middle;
  bool is_origin = false;  ///< The origin of the map: known exactly.
  /// Its node has another keyframe's viewpoint: it is kept for a while only.
  bool is_spare = false;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.sequence, s.utime, s.centre_T_base, s.centre_T_middle, s.is_origin, s.is_spare);
  }
};

/// The base of a keyframe whose landmarks and members are in the frame of `node`.
Base base_of(const model::Keyframe& keyframe, NodeIndex node, bool is_origin = false);
/// Mean of the members' poses, in the keyframe's centre frame.
geometry::SE2 middle_of(const model::Keyframe& keyframe);

/// Bases and viewpoints of a node that are kept elsewhere.
struct AwayBases {
  std::vector<Base> bases;  ///< In order of time.
  std::vector<geometry::SE2> centre_T_viewpoints;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.bases, s.centre_T_viewpoints);
  }
};

/// The bases of accepted keyframes, and an index of the viewpoints that differ: a keyframe from a
/// viewpoint that the graph has already is folded into its node, so that a stationary vehicle does
/// not grow the graph. Where the vehicle goes a known way again, or stands, the oldest bases are
/// forgotten. Poses follow the graph, which is passed in.
class Trajectory {
 public:
  /// Most bases that are kept beside the viewpoints: an hour and more on known ground.
  static constexpr std::size_t kMostSpare = 4096;

  /// `parameters` gives fold_distance_m and fold_angle_rad.
  explicit Trajectory(const SmoothingMapperParameters& parameters)
      : fold_distance_m_(parameters.fold_distance_m), fold_angle_rad_(parameters.fold_angle_rad) {}

  /// Adds the base of an accepted keyframe. O(viewpoints of its node).
  void add(const Base& base, const PoseGraph& graph);
  /// The keyframe that is added next is tied to those before it by odometry alone.
  void tear();
  /// Whether odometry alone ties two keyframes together, which are given by their numbers (size()
  /// when they were new, in any order): then what they observed does not share one error.
  bool is_torn(std::uint32_t a, std::uint32_t b) const;
  /// Adds a base that is no viewpoint: where the map stays as it is.
  void add_spare(Base base);
  /// Ties the bases of a node that is taken out of the graph to the node that has its place.
  /// O(bases since the node was added).
  void hand_over(const Retirement& retirement);
  /// Ties bases and viewpoints of nodes that became one to that one. O(bases since the nodes were
  /// added).
  void tie(std::span<const Retirement> retired, const PoseGraph& graph);
  /// Takes out bases and viewpoints of a node, but for the map's origin and the last one. O(bases).
  AwayBases put_away(NodeIndex node);
  /// Adds them again. O(bases).
  void bring_back(NodeIndex node, AwayBases away, const PoseGraph& graph);
  /// Adds all of another trajectory, whose nodes have numbers from `first` on in `graph` now. Its
  /// origin is a base like the others. O(bases).
  void absorb(Trajectory other, NodeIndex first, const PoseGraph& graph);
  /// Brings the index of viewpoints to where the graph's last updates moved the nodes, but for
  /// viewpoints that are within kStale_m of it.
  void follow(const PoseGraph& graph);

  /// The bases that are kept, in order of time.
  std::span<const Base> bases() const { return bases_; }
  /// Number of accepted keyframes.
  std::uint32_t size() const { return accepted_; }
  /// The last accepted keyframe's base; there must be one.
  const Base& last() const { return bases_.back(); }
  /// map_T_base at the present estimate.
  geometry::SE2 pose(const Base& base, const PoseGraph& graph) const;
  /// Whether the vehicle stayed within the folding distance and angle during the keyframe.
  bool is_stationary(const model::Keyframe& keyframe) const;
  /// The node of the nearest viewpoint within the folding distance and angle; none where the
  /// viewpoint is a new one, or a condensed node's. `map_T_middle`: see middle_of().
  std::optional<NodeIndex> revisited(const geometry::SE2& map_T_middle,
                                     const PoseGraph& graph) const;
  /// Calls f(node, distance [m]) for the nodes with a viewpoint within `radius_m` of `position_m`;
  /// a node with several may come several times.
  template <typename F>
  void for_each_node_near(const Eigen::Vector2d& position_m, double radius_m,
                          const PoseGraph& graph, F&& f) const {
    grid_.for_each_near(position_m, radius_m + kStale_m, [&](std::uint32_t number) {
      const Viewpoint& viewpoint = viewpoints_[number];
      const double distance_m = (middle(viewpoint, graph).translation() - position_m).norm();
      if (distance_m < radius_m) f(viewpoint.node, distance_m);
    });
  }
  /// The first keyframe's base in the frame of its node, turned round, where that base is the map's
  /// origin; none where the map was given.
  std::optional<geometry::SE2WithCovariance> origin_T_first() const;
  /// Moves the bases of keyframes up to `utime` by `by_m`, frame `map`, against their nodes.
  void keep_in_place(model::Utime utime, const Eigen::Vector2d& by_m, const PoseGraph& graph);
  /// A node's pose with the covariance that the graph has of it, as it counts from the origin.
  geometry::SE2WithCovariance from_origin(const geometry::SE2WithCovariance& map_T_centre) const;
  /// A node's pose with its marginal covariance, which counts from the map's origin.
  geometry::SE2WithCovariance centre_from_origin(NodeIndex node, const PoseGraph& graph) const;

  /// Indexes the viewpoints anew, after a load. Throws std::out_of_range where a base or a
  /// viewpoint has no node in the graph.
  void rebuild_index(const PoseGraph& graph);
  /// Members of a saved state; see common/state. rebuild_index() makes the rest from them.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.bases_, self.accepted_, self.torn_, self.viewpoints_, self.free_viewpoints_);
  }

 private:
  /// Largest distance of a viewpoint from its place in the index [m].
  static constexpr double kStale_m = 0.1;

  /// A place from which a node's landmarks were observed.
  struct Viewpoint {
    NodeIndex node = 0;
    geometry::SE2 centre_T_middle;
    bool is_free = false;  ///< Its node is gone.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.node, s.centre_T_middle, s.is_free);
    }
  };
  bool add_viewpoint(const Base& base, const PoseGraph& graph);
  void put(const Viewpoint& viewpoint, const PoseGraph& graph);
  std::span<const std::uint32_t> viewpoints_of(NodeIndex node) const;
  std::vector<std::uint32_t> take_viewpoints_of(NodeIndex node);
  void drop_viewpoints(NodeIndex node);
  void index(std::uint32_t viewpoint, const PoseGraph& graph);
  void forget_oldest();
  geometry::SE2 middle(const Viewpoint& viewpoint, const PoseGraph& graph) const {
    return graph.pose(viewpoint.node) * viewpoint.centre_T_middle;
  }

  double fold_distance_m_;
  double fold_angle_rad_;
  std::vector<Base> bases_;
  std::uint32_t accepted_ = 0;
  std::vector<std::uint32_t> torn_;  ///< Keyframes before which it is, ascending.
  std::size_t spare_ = 0;            ///< Bases that are.
  std::vector<Viewpoint> viewpoints_;
  std::vector<std::uint32_t> free_viewpoints_;
  /// A node's viewpoints, and where the index has them.
  struct IndexedNode {
    std::vector<std::uint32_t> viewpoints;
    geometry::SE2 indexed_at;
    double lever_m = 0.0;  ///< Of the viewpoint that is furthest from the node's centre.
  };
  std::map<NodeIndex, IndexedNode> indexed_;  ///< Where there are any.
  ViewpointGrid grid_;                        ///< Of the viewpoints.
};

}  // namespace understory::geoslam_mapper::smoothing
