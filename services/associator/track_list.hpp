// Tracks of landmarks around the vehicle from scan to scan, in a frame that drifts slowly.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/tracked.hpp"
#include "services/associator/observation.hpp"
#include "services/associator/parameters.hpp"

namespace understory::associator {

/// Whether a track moves, by its observations and the vehicle's motion by wheels and IMU.
enum class Steadiness : std::uint8_t {
  kUnknown = 0,
  kStationary = 1,
  kMoves = 2,
};

/// A track's observation for comparison with later ones.
struct ReferenceObservation {
  model::Utime utime = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();     ///< Frame `vehicle_level` at utime.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  ///< Likewise.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime, self.position_m, self.covariance_m2);
  }
};

/// A tracked landmark.
struct Track {
  model::TrackId id = 0;                                 ///< 0 = not consistent yet.
  std::uint64_t number = 0;                              ///< Unique for each track; never reused.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `local`.
  double detection_variance_m2 = 0.0;                    ///< Mean over its detections, per axis.
  double radius_m = 0.0;                                 ///< Mean; 0 where unknown.
  std::uint32_t observations = 0;                        ///< Matched without ambiguity.
  std::uint64_t history = 0;  ///< Bit k: matched k scans ago, of the scans that had it in view.
  std::uint32_t age = 0;      ///< Number of scans that had it in view.
  std::uint32_t missed = 0;   ///< Successive scans that had it in view and did not match it.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  Steadiness steadiness = Steadiness::kUnknown;
  std::uint32_t moved_in_a_row =
      0;                           ///< Successive observations that contradict a stationary track.
  ReferenceObservation reference;  ///< The first one; later, one of the last 1.5 s.

  /// Isotropic variance of the position, per axis.
  double variance_m2() const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.id, self.number, self.position_m, self.detection_variance_m2, self.radius_m,
      self.observations, self.history, self.age, self.missed, self.kind, self.steadiness,
      self.moved_in_a_row, self.reference);
  }
};

/// An observation and the track paired with it, as indices.
struct Match {
  std::uint32_t observation = 0;
  std::uint32_t track = 0;
  bool ambiguous = false;  ///< Another pairing is nearly as likely for the scan.
};

/// The vehicle's motion (then_T_now) by wheels and IMU from a time until now; none if it was not
/// measured.
using MotionSince =
    std::function<std::optional<geometry::SE2WithCovariance>(model::Utime then_utime)>;

/// Owns the tracks: begins, confirms and ends them. Bounded by the range of the sensor, and by
/// kMostTracks.
class TrackList {
 public:
  /// More than any scene has, even with 2,000 false detections per scan.
  static constexpr std::size_t kMostTracks = 4096;

  /// No tracks; the first id is 1.
  explicit TrackList(const AssociatorParameters& parameters) : parameters_(parameters) {}

  /// All tracks, consistent or not.
  const std::vector<Track>& tracks() const { return tracks_; }
  /// The id of the next track that becomes consistent.
  model::TrackId next_id() const { return next_id_; }
  /// The number of the next track that begins.
  std::uint64_t next_number() const { return next_number_; }
  /// Ends all tracks. Ids continue.
  void clear() { tracks_.clear(); }

  /// Decides for each matched track whether it moves. Call it before update() of the same scan if
  /// the check is on (`walking_mps` > 0).
  void check_steadiness(std::span<const Observation> observations, std::span<const Match> matches,
                        model::Utime utime, const MotionSince& motion_since);

  /// Applies a scan's matches from the pose `local_T_vehicle`. Observations without a match begin
  /// tracks; tracks that were in view too often without a match end. Returns the track id to
  /// publish for each observation, 0 = none. Cost O(tracks^2) in the worst case.
  std::vector<model::TrackId> update(std::span<const Observation> observations,
                                     std::span<const Match> matches,
                                     const geometry::SE2& local_T_vehicle,
                                     const model::FieldOfView& view, model::Utime utime);

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.tracks_, self.next_id_, self.next_number_, self.requires_proof_);
  }

 private:
  void age(std::span<const std::uint8_t> matched, const geometry::SE2& vehicle_T_local,
           const model::FieldOfView& view);
  void take(Track& track, const Observation& observation, const geometry::SE2& local_T_vehicle);
  Track& begin(const Observation& observation, const geometry::SE2& local_T_vehicle,
               model::Utime utime);
  bool is_steady(const Track& track) const;
  bool stands_in(const Track& track, std::span<const std::uint8_t> matched) const;
  void confirm(Track& track);
  void drop_excess(std::span<const std::uint8_t> matched);
  void drop(const geometry::SE2& local_T_vehicle, const model::FieldOfView& view);

  AssociatorParameters parameters_;
  std::vector<Track> tracks_;
  model::TrackId next_id_ = 1;
  std::uint64_t next_number_ = 1;
  /// Too few stationary tracks are in view: only tracks that are known to be stationary are
  /// published.
  bool requires_proof_ = false;
};

}  // namespace understory::associator
