// The landmarks around the vehicle from the last scans.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/model/landmarks.hpp"

namespace understory::keyframer::joint {

/// Number of a track; 0 = none. Unique since the start of the keyframer.
using TrackNumber = std::uint32_t;

/// A landmark of the local map.
struct Track {
  TrackNumber id = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `local`.
  double detection_variance_m2 = 0.0;                    ///< Mean over its detections, per axis.
  double radius_m = 0.0;                                 ///< Mean; 0 where unknown.
  std::uint32_t observations = 0;                        ///< Scans in which it was detected.
  std::uint64_t detected_bits = 0;                       ///< Bit k: detected k scans ago.
  std::uint64_t in_view_bits = 0;  ///< Bit k: in the field of view k scans ago.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.id, self.position_m, self.detection_variance_m2, self.radius_m, self.observations,
      self.detected_bits, self.in_view_bits, self.kind);
  }
};

/// A rolling map of tracks in the frame `local`, which drifts slowly. Bounded: tracks behind the
/// vehicle are removed, and beyond kMostTracks the oldest of those that the scan did not detect.
class LocalMap {
 public:
  /// More than any scene has; the scans of a keyframe with 1,000 false detections each.
  static constexpr std::size_t kMostTracks = 8192;

  /// Two tracks within `gate_sigmas` of their noise may be one landmark.
  explicit LocalMap(double gate_sigmas) : gate_sigmas_(gate_sigmas) {}

  /// Adds a scan from the pose `local_T_vehicle`. `pairs` (reference = index of a track, observed =
  /// index of a detection) update tracks; each other detection begins one. Returns the track of
  /// each detection. Cost O(tracks * log(tracks)).
  std::vector<TrackNumber> add(const model::LandmarkScan& scan,
                               std::span<const geometry::PointPair> pairs,
                               const geometry::SE2& local_T_vehicle);
  /// Removes all tracks. Numbers continue.
  void clear();

  /// The tracks as points for the registration of a scan, in the same order.
  std::vector<geometry::UncertainPoint> reference_points() const;
  /// Number of tracks that a scan from `local_T_vehicle` can match: those in view with two
  /// observations or more, or all tracks if there are none of these.
  std::size_t matchable(const geometry::SE2& local_T_vehicle, const model::FieldOfView& view) const;

  /// The tracks that these were merged into, or themselves if unmerged, in the same order. O((ids +
  /// merged) * log(merged)).
  std::vector<TrackNumber> resolved(std::span<const TrackNumber> ids) const;
  /// The track with this number; null if it was removed or merged.
  const Track* find(TrackNumber id) const;
  /// Tracks, ascending, that lie within the noise of an older one and were never detected together
  /// with it: they may be the same landmark. All tracks of a crowd that cannot be resolved are
  /// included. O(tracks * log(tracks)).
  std::vector<TrackNumber> doubtful() const;

  /// Members of a saved state; see common/state. The gate is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.tracks_, self.merged_, self.next_id_);
  }

 private:
  void age(const model::FieldOfView& view, const geometry::SE2& local_T_vehicle);
  void begin(const model::Detection& detection, const geometry::SE2& local_T_vehicle);
  bool within_noise(const Track& a, const Track& b) const;
  void merge_doubles();
  bool is_double(const Track& a, const Track& b) const;
  void absorb(Track& a, const Track& b);
  void drop_excess();
  void drop_distant(double max_range_m, const Eigen::Vector2d& vehicle_m);

  double gate_sigmas_;
  std::vector<Track> tracks_;                                ///< In order of number.
  std::vector<std::pair<TrackNumber, TrackNumber>> merged_;  ///< (old, new), the recent ones.
  TrackNumber next_id_ = 1;
};

/// Isotropic variance [m^2] of a detection's position in the plane, per axis.
double plane_variance(const model::Detection& detection);

}  // namespace understory::keyframer::joint
