// Score of the associator: purity of tracks, and landmarks that change their track.
#pragma once

#include <cstdint>

#include "services/associator/parameters.hpp"
#include "sim/inertial_drive.hpp"

namespace understory::eval::experiments::frontend {

/// One simulated drive through the associator.
struct TrackingOptions {
  sim::InertialDriveParameters drive;
  associator::AssociatorParameters associator;
  double duration_s = 120.0;
};

/// How well tracks and landmarks agree.
struct TrackingResult {
  double driven_km = 0.0;
  std::uint64_t published = 0;  ///< Detections with a track id.
  std::uint64_t tracks = 0;     ///< Ids given.
  /// Share of the published detections that are of the landmark that most of their track's are;
  /// false detections never are.
  double purity = 0.0;
  /// A landmark got another id than it had, though it stayed in the field of view.
  std::uint64_t switches = 0;
  double switches_per_km = 0.0;
  double published_share = 0.0;    ///< Of the true detections.
  std::uint64_t false_tracks = 0;  ///< Mostly false detections.
  std::uint64_t scans_lost = 0;
  double scan_p50_s = 0.0;
  double scan_p99_s = 0.0;
};
/// Drives once through `world`; everything but the times follows from `seed`.
TrackingResult run_tracking(const TrackingOptions& options, const sim::TrunkField& world,
                            std::uint64_t seed);

}  // namespace understory::eval::experiments::frontend
