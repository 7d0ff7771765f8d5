// The clouds of the last metres, with their poses.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/place_scan.hpp"

namespace understory::loop_closer {

/// A cloud with its pose.
struct PlacedCloud {
  double along_m = 0.0;  ///< Path.
  geometry::SE2 map_T_scan;
  std::vector<model::PlacePoint> points;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.along_m, s.map_T_scan, s.points);
  }
};

/// Joins PLACE_SCAN with the keyframe of its scan, whose pose the mapper gives. Keeps the newest
/// cloud with a pose, and a few that wait.
class PlaceClouds {
 public:
  /// A cloud; the update of its keyframe must come later. At most kMostPending wait.
  void add(model::PlaceScan scan);
  /// Sets the poses of a keyframe's clouds. `along_m`: path at the keyframe.
  void add(const model::Keyframe& keyframe, const model::MapUpdate& update, double along_m);
  /// The map was corrected: drops the newest cloud.
  void restart() { newest_.reset(); }

  /// The newest cloud, frame `vehicle_level` of a base at `map_T_base`; empty if there is none at
  /// or after path length `from_m`.
  std::vector<model::PlacePoint> seen_from(const geometry::SE2& map_T_base, double from_m) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.pending_, self.newest_);
  }

 private:
  static constexpr std::size_t kMostPending = 32;

  std::deque<model::PlaceScan> pending_;  ///< In order of time.
  std::optional<PlacedCloud> newest_;
};

}  // namespace understory::loop_closer
