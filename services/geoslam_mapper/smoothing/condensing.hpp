// The path behind the vehicle, condensed.
#pragma once

#include <deque>
#include <vector>

#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/discovery.hpp"
#include "services/geoslam_mapper/smoothing/fusion.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/known_ground.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Keeps the graph's cost to that of the ground around the vehicle: the nodes of each stretch of
/// the path become one, with one condensed measurement of each landmark (thesis on submaps §3.4.2),
/// once the vehicle is so far on that it does not see from there any more. All that is not
/// condensed yet stays exact.
class Condensing {
 public:
  /// `parameters` gives `condense_m`, `condense_of_range` and `condense_after_m`.
  explicit Condensing(const SmoothingMapperParameters& parameters)
      : length_m_(parameters.condense_m),
        of_range_(parameters.condense_of_range),
        after_m_(parameters.condense_after_m) {}

  /// To be called after each accepted keyframe. Condenses at most one stretch, and solves; the map
  /// is as before where that fails. Cost: what the nodes of the stretch observed.
  /// `known_ground`: what it has not judged yet waits. Returns the nodes of a stretch that became
  /// one.
  std::vector<Retirement> follow(const FusedKeyframe& fused, const KnownGround& known_ground,
                                 Discovery& discovery, Merges& merges, GlobalMap& map);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_);
  }

 private:
  /// A node that is not condensed yet.
  struct Passed {
    NodeIndex node = 0;
    double along_m = 0.0;  ///< Path of the vehicle up to it.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.node, s.along_m);
    }
  };
  std::vector<NodeIndex> take_stretch(double length_m, double end_m,
                                      const KnownGround& known_ground, const PoseGraph& graph);

  double length_m_;
  double of_range_;
  double after_m_;
  std::deque<Passed> waiting_;  ///< In order of time.
};

}  // namespace understory::geoslam_mapper::smoothing
