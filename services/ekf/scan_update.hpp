// One scan while the filter works on it.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/model/tracked.hpp"
#include "services/ekf/landmark_update.hpp"

namespace understory::ekf {

/// All that belongs to one scan: a value that ends with the scan. The first four vectors have one
/// element per usable observation.
struct ScanUpdate {
  std::vector<Observation> observations;
  std::vector<std::uint32_t> scan_index;  ///< Index in TrackedScan::landmarks.
  std::vector<model::TrackId> tracks;
  std::vector<bool> is_settled;  ///< Its landmark is known: it was paired or refused.
  std::uint32_t used = 0;        ///< Observations that updated the state.
  std::uint32_t refused = 0;     ///< Observations that a gate refused.
  /// Squared Mahalanobis distance of the innovations of known landmarks, those that a gate refused
  /// with the gate's; and their degrees of freedom.
  double nis = 0.0;
  int nis_degrees = 0;

  /// The detection of observation `k`; `scan` is the one that this was read from.
  const model::Detection& detection(const model::TrackedScan& scan, std::size_t k) const {
    return scan.landmarks[scan_index[k]].observed;
  }
};

/// The usable observations of a scan: finite, with a positive definite covariance and a track.
/// `level_covariance`: of the level's error [rad^2] as the detections' covariances contain it; the
/// state has that error, so it is taken out of theirs.
ScanUpdate read_scan(const model::TrackedScan& scan,
                     const std::optional<Eigen::Matrix2d>& level_covariance);

/// True where most landmarks of the scan were refused: at least four, and more than twice as many
/// as updated the state.
bool is_at_odds(const ScanUpdate& update);

/// Replaces the heights of known landmarks' observations by those that they were first observed at,
/// corrected for the vehicle's rise and fall, which all landmarks have in common. The level
/// displaces an observation by its height. Where a trunk leans, noise of the height displaces it
/// too, and would pass for an error of the level.
void steady_heights(FilterState& state, std::span<const Pairing> known, ScanUpdate& update);

}  // namespace understory::ekf
