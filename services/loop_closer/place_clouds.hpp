// The clouds of the last metres, and where they were taken.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/place_scan.hpp"

namespace understory::loop_closer {

/// A cloud, and where it was taken.
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

/// Joins PLACE_SCAN with the keyframe that has its scan: the mapper says where that one is. Keeps
/// the newest cloud that was placed, and a few that wait.
class PlaceClouds {
 public:
  /// A cloud; the update of its keyframe must come later. At most kMostPending wait.
  void add(model::PlaceScan scan);
  /// Places the clouds of a keyframe's scans. `along_m`: path at the keyframe.
  void add(const model::Keyframe& keyframe, const model::MapUpdate& update, double along_m);
  /// The map was corrected: what was placed before counts no more.
  void restart() { newest_.reset(); }

  /// The newest cloud, frame `vehicle_level` of a base at `map_T_base`; empty where none was placed
  /// at or after `from_m` of path.
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
