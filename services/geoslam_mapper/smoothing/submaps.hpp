// Parts of the map that are kept elsewhere.
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

/// Keeps what the mapper holds to the ground around the vehicle. A submap is a condensed node with
/// the dormant landmarks that it observed first and the bases of its keyframes, in its frame. Far
/// from the vehicle it is given away, whole; in the graph stay the node and its motions, so that
/// every estimate is what it would be with the submap there. It comes back before the vehicle can
/// see any of it.
class Submaps {
 public:
  /// `parameters` gives `hand_over_m`; 0: nothing is handed over.
  explicit Submaps(const SmoothingMapperParameters& parameters)
      : hand_over_m_(parameters.hand_over_m) {}

  /// Nothing more is handed over while this is false; what is away comes back as before.
  void may_hand_over(bool may) { may_hand_over_ = may; }
  /// A stretch of the path became this node.
  void condensed(NodeIndex node) { here_.push_back({node, std::nullopt}); }
  /// To be called after accepted keyframes. One submap goes or is wanted back at each: what the
  /// vehicle comes near first, else what is far. True where there is one; the solved graph is as
  /// it was, unless it froze or thawed nodes. Cost: one distance for each submap that is here, and
  /// what goes; every few metres one for each that is away.
  bool follow(const model::FieldOfView& field_of_view, NodeIndex newest, model::Utime utime,
              GlobalMap& map);

  /// What was given away since the last call.
  std::vector<model::Submap> take_given_away() { return std::exchange(given_away_, {}); }
  /// What is wanted back and has not come yet, in the order in which it is needed.
  const std::vector<model::SubmapId>& wanted() const { return wanted_; }
  /// Puts a submap back. Returns why not, where it is not away or not as it was; the map is
  /// unchanged then. What its landmarks tell is in the graph already, which does not change. Solves
  /// where a node of it is frozen.
  std::string bring_back(const model::Submap& submap, GlobalMap& map);
  /// Where all that was ever given away is, in order of id.
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
  /// A submap that the map holds.
  struct Here {
    NodeIndex node = 0;
    std::optional<model::SubmapId> was;  ///< When it was away last.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.node, s.was);
    }
  };
  /// A submap that is kept elsewhere.
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
  std::vector<model::SubmapId> coming_;  ///< To be asked for, the nearest first.
  std::vector<model::SubmapId> wanted_;
  std::vector<model::Submap> given_away_;
  model::SubmapId next_id_ = 1;
  std::size_t unfreezable_ = 0;  ///< Submaps that could not leave the solved graph.
  double looked_m_ = 0.0;        ///< Path of the vehicle when it looked around.
  std::optional<double> far_m_;  ///< From here on submaps go; none before the first look.
};

}  // namespace understory::geoslam_mapper::smoothing
