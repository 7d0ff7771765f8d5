// Poses of all keyframes, and which of them share a viewpoint.
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

/// A keyframe's base, rigidly tied to a node without other measurements.
struct Base {
  NodeIndex node = 0;
  std::uint64_t sequence = 0;  ///< Of the keyframe.
  model::Utime utime = 0;
  geometry::SE2WithCovariance centre_T_base;  ///< In the node's frame.
  /// Mean of the keyframe's members, in the node's frame: the position of the keyframe, three times
  /// as accurate as the base alone.
  geometry::SE2 centre_T_middle;
  bool is_origin = false;  ///< The origin of the map: known exactly.
  /// Its node has another keyframe's viewpoint: it is kept only for a while.
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

/// Bases and viewpoints of a node that are stored elsewhere.
struct AwayBases {
  std::vector<Base> bases;  ///< In order of time.
  std::vector<geometry::SE2> centre_T_viewpoints;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.bases, s.centre_T_viewpoints);
  }
};

/// The bases of accepted keyframes, and an index of distinct viewpoints: a keyframe from a known
/// viewpoint is folded into its node, so a stationary vehicle does not enlarge the graph. When the
/// vehicle repeats a way or stands, the oldest bases are deleted. Poses follow the graph, which is
/// passed in.
class Trajectory {
 public:
  /// Most bases that are kept beside the viewpoints: more than an hour on known ground.
  static constexpr std::size_t kMostSpare = 4096;

  /// `parameters` gives fold_distance_m and fold_angle_rad.
  explicit Trajectory(const SmoothingMapperParameters& parameters)
      : fold_distance_m_(parameters.fold_distance_m), fold_angle_rad_(parameters.fold_angle_rad) {}

  /// Adds the base of an accepted keyframe. O(viewpoints of its node).
  void add(const Base& base, const PoseGraph& graph);
  /// Marks the next keyframe as tied to earlier ones by odometry alone.
  void tear();
  /// Whether odometry alone ties two keyframes together, given by their numbers (size() when they
  /// were new, in any order): then their observations do not share one error.
  bool is_torn(std::uint32_t a, std::uint32_t b) const;
  /// Adds a base that is no viewpoint, when the map stays unchanged.
  void add_spare(Base base);
  /// Moves the bases of a removed node to the node that replaces it. O(bases since the node was
  /// added).
  void hand_over(const Retirement& retirement);
  /// Moves bases and viewpoints of condensed nodes to the new node. O(bases since the nodes were
  /// added).
  void tie(std::span<const Retirement> retired, const PoseGraph& graph);
  /// Removes and returns bases and viewpoints of a node, except the map's origin and the last one.
  /// O(bases).
  AwayBases put_away(NodeIndex node);
  /// Adds them again. O(bases).
  void bring_back(NodeIndex node, AwayBases away, const PoseGraph& graph);
  /// Adds all of another trajectory, whose nodes now have numbers from `first` on in `graph`. Its
  /// origin becomes an ordinary base. O(bases).
  void absorb(Trajectory other, NodeIndex first, const PoseGraph& graph);
  /// Moves the index of viewpoints to the nodes' latest estimates, except viewpoints that are
  /// within kStale_m of their entry.
  void follow(const PoseGraph& graph);

  /// The bases in memory, in order of time.
  std::span<const Base> bases() const { return bases_; }
  /// Number of accepted keyframes.
  std::uint32_t size() const { return accepted_; }
  /// The last accepted keyframe's base; it must exist.
  const Base& last() const { return bases_.back(); }
  /// map_T_base at the present estimate.
  geometry::SE2 pose(const Base& base, const PoseGraph& graph) const;
  /// Whether the vehicle stayed within the folding distance and angle during the keyframe.
  bool is_stationary(const model::Keyframe& keyframe) const;
  /// The node of the nearest viewpoint within the folding distance and angle; none for a new
  /// viewpoint, or one of a condensed node. `map_T_middle`: see middle_of().
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
  /// The inverse of the first keyframe's base in its node's frame, if that base is the map's
  /// origin; none if the map was given.
  std::optional<geometry::SE2WithCovariance> origin_T_first() const;
  /// Moves the bases of keyframes up to `utime` by `by_m`, frame `map`, relative to their nodes.
  void keep_in_place(model::Utime utime, const Eigen::Vector2d& by_m, const PoseGraph& graph);
  /// Converts a node's marginal covariance in the graph to one relative to the map's origin.
  geometry::SE2WithCovariance from_origin(const geometry::SE2WithCovariance& map_T_centre) const;
  /// A node's pose with its marginal covariance relative to the map's origin.
  geometry::SE2WithCovariance centre_from_origin(NodeIndex node, const PoseGraph& graph) const;

  /// Rebuilds the index of viewpoints after a load. Throws std::out_of_range if a base or a
  /// viewpoint has no node in the graph.
  void rebuild_index(const PoseGraph& graph);
  /// Members of a saved state; see common/state. rebuild_index() computes the rest.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.bases_, self.accepted_, self.torn_, self.viewpoints_, self.free_viewpoints_);
  }

 private:
  /// Largest distance of a viewpoint from its entry in the index [m].
  static constexpr double kStale_m = 0.1;

  /// A place from which a node's landmarks were observed.
  struct Viewpoint {
    NodeIndex node = 0;
    geometry::SE2 centre_T_middle;
    bool is_free = false;  ///< Its node was removed.

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
  std::vector<std::uint32_t> torn_;  ///< Keyframes after a call of tear(), ascending.
  std::size_t spare_ = 0;            ///< Number of spare bases.
  std::vector<Viewpoint> viewpoints_;
  std::vector<std::uint32_t> free_viewpoints_;
  /// A node's viewpoints, and its position in the index.
  struct IndexedNode {
    std::vector<std::uint32_t> viewpoints;
    geometry::SE2 indexed_at;
    double lever_m = 0.0;  ///< Of the viewpoint that is furthest from the node's centre.
  };
  std::map<NodeIndex, IndexedNode> indexed_;  ///< Only nodes that have any.
  ViewpointGrid grid_;                        ///< Of the viewpoints.
};

}  // namespace understory::geoslam_mapper::smoothing
