// Follows landmarks from scan to scan in a frame that drifts slowly: which detection is which
// landmark.
#pragma once

#include <optional>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/model/landmarks.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer {

/// A landmark of the rolling local map.
struct Track {
  std::uint32_t id = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `local`.
  double detection_variance_m2 = 0.0;                    ///< Mean over its detections.
  double radius_m = 0.0;
  std::uint32_t observations = 0;
  std::uint64_t seen = 0;     ///< Bit k: detected k scans ago.
  std::uint64_t in_view = 0;  ///< Bit k: in the field of view k scans ago.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
};

/// A scan with its place in `local` and the track of each detection.
struct FollowedScan {
  bool tracked = false;
  geometry::SE2 local_T_vehicle;
  std::vector<std::uint32_t> tracks;  ///< Per detection; the scan's own new tracks included.
};

/// Registers each scan to a rolling map of the last ones. Works without odometry, and through turns
/// between scans that no motion model foresees: when the predicted pose does not fit, headings
/// around it are tried.
class ScanTracker {
 public:
  explicit ScanTracker(const JointKeyframerParameters& parameters) : parameters_(parameters) {}

  /// `motion`: of the vehicle since the last scan, where odometry knows it. An untracked scan
  /// changes nothing.
  FollowedScan add(const model::LandmarkScan& scan,
                   const std::optional<geometry::SE2WithCovariance>& motion);
  /// Forgets everything and starts `local` at this scan.
  FollowedScan restart(const model::LandmarkScan& scan);
  bool empty() const { return tracks_.empty() && !started_; }
  /// The track that `id` was merged into, or itself.
  std::uint32_t resolved(std::uint32_t id) const;
  /// Null where it was dropped.
  const Track* find(std::uint32_t id) const;

  /// Lies within the noise of an older track and was never detected beside it: perhaps the same
  /// landmark.
  bool doubtful(const Track& track) const;

  struct State {
    std::vector<Track> tracks;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> merged;
    std::uint32_t next_id = 1;
    bool started = false;
    geometry::SE2 local_T_vehicle;
    geometry::SE2 last_motion;
  };
  State state() const;
  void set_state(const State& state);

 private:
  std::optional<geometry::Registration> locate(
      const model::LandmarkScan& scan,
      const std::optional<geometry::SE2WithCovariance>& motion) const;
  bool fits(const geometry::Registration& registration, const model::LandmarkScan& scan) const;
  FollowedScan fuse(const model::LandmarkScan& scan, const geometry::Registration& registration);
  void update_visibility(const model::LandmarkScan& scan);
  bool within_noise(const Track& a, const Track& b) const;
  void merge_doubles();
  void absorb(Track& a, const Track& b);
  void drop_distant(const model::LandmarkScan& scan);

  JointKeyframerParameters parameters_;
  std::vector<Track> tracks_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> merged_;  ///< (old, new), recent ones.
  std::uint32_t next_id_ = 1;
  bool started_ = false;
  geometry::SE2 local_T_vehicle_;
  geometry::SE2 last_motion_;
};

/// Isotropic variance [m^2] in the plane of a detection.
double plane_variance(const model::Detection& detection);

}  // namespace understory::keyframer
