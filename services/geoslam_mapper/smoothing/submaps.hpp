// Parts of the map that are stored elsewhere.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/model/landmarks.hpp"
#include "common/model/submap.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Limits the mapper's memory to the map around the vehicle. A submap is a condensed node with the
/// dormant landmarks that it observed first and the bases of its keyframes, in its frame. Far from
/// the vehicle the whole submap is handed over; the node and its motions stay in the graph, so
/// every estimate is the same as with the submap. It is loaded again before the vehicle can see any
/// of it.
class Submaps {
 public:
  /// `parameters` gives `hand_over_m`; 0: nothing is handed over.
  explicit Submaps(const SmoothingMapperParameters& parameters)
      : hand_over_m_(parameters.hand_over_m) {}

  /// While false, nothing is handed over; stored submaps are loaded as before.
  void may_hand_over(bool may) { may_hand_over_ = may; }
  /// A stretch of the path was condensed into this node.
  void condensed(NodeIndex node) { here_.push_back({node, std::nullopt}); }
  /// Call it after accepted keyframes. Each time at most one submap is requested or handed over;
  /// loading near submaps has priority over handing over distant ones. True if there is one; the
  /// solved graph is unchanged, unless nodes were frozen or thawed. Cost: one distance per submap
  /// in memory, and the submap handed over; every few metres one distance per stored submap.
  bool follow(const model::FieldOfView& field_of_view, NodeIndex newest, model::Utime utime,
              GlobalMap& map);

  /// Submaps handed over since the last call.
  std::vector<model::Submap> take_given_away() { return std::exchange(given_away_, {}); }
  /// Submaps that are requested and not loaded yet, in order of need.
  const std::vector<model::SubmapId>& wanted() const { return wanted_; }
  /// Puts a submap back. Returns the reason, with the map unchanged, if it is not handed over or
  /// has changed. The information of its landmarks is in the graph already, which does not change.
  /// Solves if a node of it is frozen.
  std::string bring_back(const model::Submap& submap, GlobalMap& map);
  /// Poses of all submaps ever handed over, in order of id.
  std::vector<model::SubmapPose> poses(const PoseGraph& graph) const;
  /// The node of a submap; none where there is no such submap.
  std::optional<NodeIndex> node_of(model::SubmapId id) const;

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.here_, self.away_, self.coming_, self.wanted_, self.next_id_, self.unfreezable_,
      self.looked_m_, self.far_m_);
  }

 private:
  /// A submap in memory.
  struct Here {
    NodeIndex node = 0;
    std::optional<model::SubmapId> was;  ///< Its id when it was last stored.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.node, s.was);
    }
  };
  /// A submap that is stored elsewhere.
  struct Away {
    NodeIndex node = 0;
    model::SubmapId id = 0;
    std::uint64_t content_hash = 0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.node, s.id, s.content_hash);
    }
  };
  bool look_around(const model::FieldOfView& field_of_view, NodeIndex newest, GlobalMap& map);
  bool ask_for_next();
  bool give_next_away(NodeIndex newest, model::Utime utime, GlobalMap& map);
  void give_away(const Here& here, model::Utime utime, GlobalMap& map);
  void close_origin(const Eigen::Vector2d& vehicle_m, GlobalMap& map);
  bool freeze(double reach_m, const Eigen::Vector2d& vehicle_m, GlobalMap& map);

  double hand_over_m_;
  bool may_hand_over_ = true;
  std::vector<Here> here_;
  std::deque<Away> away_;                ///< In order of id.
  std::vector<model::SubmapId> coming_;  ///< To be requested, the nearest first.
  std::vector<model::SubmapId> wanted_;
  std::vector<model::Submap> given_away_;
  model::SubmapId next_id_ = 1;
  std::size_t unfreezable_ = 0;  ///< Submaps that could not be frozen.
  double looked_m_ = 0.0;        ///< Path length of the vehicle at the last look_around().
  std::optional<double> far_m_;  ///< Hand-over distance; none before the first look_around().
};

}  // namespace understory::geoslam_mapper::smoothing
