// Data of one scan during its processing.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/model/tracked.hpp"
#include "services/ekf/landmark_update.hpp"

namespace understory::ekf {

/// All data of one scan. The first four vectors have one element per usable observation.
struct ScanUpdate {
  std::vector<Observation> observations;
  std::vector<std::uint32_t> scan_index;  ///< Index in TrackedScan::landmarks.
  std::vector<model::TrackId> tracks;
  std::vector<bool> is_settled;  ///< It was paired or refused.
  std::uint32_t used = 0;        ///< Observations that updated the state.
  std::uint32_t refused = 0;     ///< Observations that a gate refused.
  /// Squared Mahalanobis distance of the innovations of known landmarks, with the gate's value for
  /// refused ones; and their degrees of freedom.
  double nis = 0.0;
  int nis_degrees = 0;

  /// The detection of observation `k`; `scan` must be the scan that this was read from.
  const model::Detection& detection(const model::TrackedScan& scan, std::size_t k) const {
    return scan.landmarks[scan_index[k]].observed;
  }
};

/// The usable observations of a scan: finite, with a positive definite covariance and a track.
/// `level_covariance`: part of the detections' covariances that comes from the level's error
/// [rad^2]; the state contains that error, so it is subtracted.
ScanUpdate read_scan(const model::TrackedScan& scan,
                     const std::optional<Eigen::Matrix2d>& level_covariance);

/// Whether most landmarks of the scan were refused: at least four, and more than twice as many as
/// updated the state.
bool is_at_odds(const ScanUpdate& update);

/// Replaces the heights of known landmarks' observations by the heights of their first observation,
/// corrected for the vehicle's rise and fall, which all landmarks have in common. The level error
/// displaces an observation in proportion to its height. At a leaning trunk noise of the height
/// displaces it, too, and would be taken for an error of the level.
void steady_heights(FilterState& state, std::span<const Pairing> known, ScanUpdate& update);

}  // namespace understory::ekf
