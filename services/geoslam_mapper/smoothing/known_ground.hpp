// What is seen again adds information, not states.
#pragma once

#include <optional>
#include <vector>

#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/discovery.hpp"
#include "services/geoslam_mapper/smoothing/fusion.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Keeps the graph's size to that of the ground driven on. A node near an older one of another
/// pass, most of whose landmarks the older one observed, loses its motions some keyframes later; on
/// further passes the whole node goes, and what it observed is added to the older one's (a reduced
/// pose graph, as Johannsson et al. 2013 describe; here with the landmarks). The last nodes stay as
/// they are: the pose now has all that odometry tells.
class KnownGround {
 public:
  /// `parameters` gives `known_ground_m`.
  explicit KnownGround(const SmoothingMapperParameters& parameters)
      : radius_m_(parameters.known_ground_m) {}

  /// To be called after each accepted keyframe. Takes out what can be, several nodes at a time, and
  /// solves; the map is as before where that fails. Cost: what the nodes observed.
  /// Returns the nodes that were taken out.
  std::vector<Retirement> follow(const FusedKeyframe& fused, Discovery& discovery, Merges& merges,
                                 GlobalMap& map);

  /// Whether the node is one of the last ones, which it has not judged yet.
  bool is_recent(NodeIndex node) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.recent_);
  }

 private:
  /// The node of a keyframe.
  struct Passed {
    NodeIndex node = 0;
    bool is_new = false;  ///< Not one that was there before.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.node, s.is_new);
    }
  };
  Surplus find_surplus(const GlobalMap& map) const;
  void judge(NodeIndex node, const GlobalMap& map, Surplus& surplus) const;
  std::optional<NodeIndex> reference_of(NodeIndex node, const GlobalMap& map) const;

  double radius_m_;
  std::vector<Passed> recent_;  ///< In order of time.
};

}  // namespace understory::geoslam_mapper::smoothing
