// Tracks landmarks from scan to scan, in a frame that drifts slowly.
#pragma once

#include <optional>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/model/landmarks.hpp"
#include "services/keyframer/joint/local_map.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer::joint {

/// The pose of a scan, and the track of each of its detections.
struct PlacedScan {
  geometry::SE2 local_T_vehicle;
  std::vector<TrackNumber> tracks;  ///< Per detection; including new tracks.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.local_T_vehicle, self.tracks);
  }
};

/// Registers each scan to a rolling map of the last ones. It works without odometry, and through
/// rotations between scans that no motion model predicts: if the predicted pose does not fit, the
/// headings around it are tried.
class ScanTracker {
 public:
  /// An empty map: the first scan starts it.
  explicit ScanTracker(const JointKeyframerParameters& parameters)
      : parameters_(parameters), map_(parameters.gate_sigmas) {}

  /// Adds the next scan. `motion`: of the vehicle since the last scan (last_T_this), if odometry
  /// measured it. Returns none, without change, if the scan has too few matches in the map. With
  /// odometry a scan always gets a pose.
  std::optional<PlacedScan> add(const model::LandmarkScan& scan,
                                const std::optional<geometry::SE2WithCovariance>& motion);
  /// Clears the map and starts `local` at this scan.
  PlacedScan restart(const model::LandmarkScan& scan);

  /// The tracks after the last scan.
  const LocalMap& map() const { return map_; }
  /// Number of scans since the last (re)start of tracking, including the last one.
  std::uint64_t scans() const { return scans_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.map_, self.scans_, self.local_T_vehicle_, self.last_motion_);
  }

 private:
  std::optional<geometry::Registration> locate(
      const model::LandmarkScan& scan,
      const std::optional<geometry::SE2WithCovariance>& motion) const;
  bool fits(const geometry::Registration& registration, const model::LandmarkScan& scan) const;

  JointKeyframerParameters parameters_;
  LocalMap map_;
  std::uint64_t scans_ = 0;
  geometry::SE2 local_T_vehicle_;  ///< At the last scan.
  geometry::SE2 last_motion_;      ///< Between the last two scans.
};

}  // namespace understory::keyframer::joint
