// Counts of used and refused input, for HEALTH.
#pragma once

#include <cstdint>
#include <string>

namespace understory::ekf {

/// Counts since the process started; not saved.
struct EkfCounters {
  std::uint64_t odometry = 0;            ///< Increments received.
  std::uint64_t odometry_refused = 0;    ///< Late, repeated, overlapping or not finite.
  std::uint64_t gaps = 0;                ///< Intervals without odometry.
  std::uint64_t scans = 0;               ///< Scans received.
  std::uint64_t scans_refused = 0;       ///< Late or repeated.
  std::uint64_t landmarks_used = 0;      ///< Observations that updated the state.
  std::uint64_t landmarks_refused = 0;   ///< By their own gate or the gate of the scan.
  std::uint64_t landmarks_unusable = 0;  ///< Not finite, no covariance, or without a track.
  std::uint64_t landmarks_too_near =
      0;                          ///< New ones too near to an old one, or the state was full.
  std::uint64_t rejoined = 0;     ///< New tracks that were paired with a lost landmark.
  std::uint64_t removed = 0;      ///< Landmarks that left the active state.
  std::uint64_t crept = 0;        ///< Times the vehicle moved while reported stationary.
  std::uint64_t clock_jumps = 0;  ///< Stamps far behind earlier ones: the filter began anew.
  std::uint64_t restarts = 0;     ///< See model::EkfPose::reset_counter.
  std::string last_reason;        ///< For the latest refusal or restart.
};

}  // namespace understory::ekf
