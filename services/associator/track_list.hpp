// The landmarks that are followed at the moment, in a frame that drifts slowly.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/tracked.hpp"
#include "services/associator/parameters.hpp"

namespace understory::associator {

/// A usable detection.
struct Seen {
  std::uint32_t detection = 0;                           ///< Index in the scan.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `vehicle_level`.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  double radius_m = 0.0;
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;

  double variance_m2() const { return 0.5 * covariance_m2.trace(); }
};

/// Whether the track stands, by what wheels say of the vehicle.
enum class Steadiness : std::uint8_t { kUnknown = 0, kStationary = 1, kMoves = 2 };

/// A sighting to compare later ones with.
struct Beginning {
  model::Utime utime = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `vehicle_level` at utime.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
};

struct Track {
  model::TrackId id = 0;                                 ///< 0 = not consistent yet.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `local`.
  double detection_variance_m2 = 0.0;                    ///< Mean over its detections.
  double radius_m = 0.0;
  std::uint32_t observations = 0;
  std::uint64_t history = 0;  ///< Bit k: matched k scans ago, counting scans that should show it.
  std::uint32_t age = 0;      ///< Such scans since it began.
  std::uint32_t missed = 0;   ///< Such scans in a row without it.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  Steadiness steadiness = Steadiness::kUnknown;
  std::uint32_t times_off = 0;  ///< Sightings in a row that say that it moves.
  Beginning begin;

  /// Of the position.
  double variance_m2() const;
};

/// Pair of a seen detection and a track.
struct Match {
  std::uint32_t seen = 0;
  std::uint32_t track = 0;
  bool ambiguous = false;  ///< Another pairing explains the scan nearly as well.
};

/// One-to-one pairs inside the gate at the pose `local_T_vehicle`, likeliest first, then improved
/// by swaps; kinds never mix.
std::vector<Match> match(std::span<const Track> tracks, std::span<const Seen> seen,
                         const geometry::SE2WithCovariance& local_T_vehicle,
                         const AssociatorParameters& parameters);

class TrackList {
 public:
  explicit TrackList(const AssociatorParameters& parameters) : parameters_(parameters) {}

  const std::vector<Track>& tracks() const { return tracks_; }
  void clear() { tracks_.clear(); }

  /// Takes a scan's matches at the pose; unmatched detections begin tracks, tracks that should have
  /// been seen and were not end. Gives the track id of each seen detection, 0 = none to publish.
  std::vector<model::TrackId> update(std::span<const Seen> seen, std::span<const Match> matches,
                                     const geometry::SE2& local_T_vehicle,
                                     const model::FieldOfView& view, model::Utime utime);

  /// Looks whether tracks stand that the scan matches; to be called before update().
  /// `motion_since` gives the vehicle's motion by wheels from a time until now, where it is known.
  void check_steadiness(
      std::span<const Seen> seen, std::span<const Match> matches, model::Utime utime,
      const std::function<std::optional<geometry::SE2WithCovariance>(model::Utime)>& motion_since);

  model::TrackId next_id() const { return next_id_; }
  void set(const std::vector<Track>& tracks, model::TrackId next_id) {
    tracks_ = tracks;
    next_id_ = next_id;
  }

 private:
  void take(Track& track, const Seen& seen, const Match& match,
            const geometry::SE2& local_T_vehicle);
  bool is_steady(const Track& track) const;
  bool stands_in(const Track& track, std::span<const bool> matched) const;
  void confirm(Track& track);
  void drop(const geometry::SE2& local_T_vehicle, const model::FieldOfView& view);

  AssociatorParameters parameters_;
  std::vector<Track> tracks_;
  model::TrackId next_id_ = 1;
  bool needs_proof_ = false;  ///< Too few that stand are in the scan to do without.
};

}  // namespace understory::associator
