#include "services/ekf/scan_update.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "common/model/level.hpp"
#include "services/ekf/ground_marks.hpp"

namespace understory::ekf {
namespace {

/// Least ratio of a detection's variance of height to that from the level; below it the detection
/// was not levelled.
constexpr double kLevelled = 0.5;
/// Gain for a scan's change of height: it is noisy, and slopes are gentle.
constexpr double kRiseGain = 0.2;
/// Fewest refused observations of a scan that contradicts the map.
constexpr std::uint32_t kFewRefused = 4;

bool is_usable(const model::Detection& detection) {
  if (!detection.position_m.allFinite() || !detection.covariance_m2.allFinite()) return false;
  const Eigen::Matrix2d covariance = detection.covariance_m2.topLeftCorner<2, 2>();
  return covariance.llt().info() == Eigen::Success;
}

Observation observation_of(const model::Detection& detection,
                           const std::optional<Eigen::Matrix2d>& level_covariance) {
  const Eigen::Matrix2d whole = detection.covariance_m2.topLeftCorner<2, 2>();
  Observation observation{detection.position_m.head<2>(), whole};
  if (!level_covariance) return observation;

  // A height that is more accurate than the level was not levelled.
  const Eigen::Vector2d up(detection.position_m.y(), -detection.position_m.x());
  if (detection.covariance_m2(2, 2) < kLevelled * up.dot(*level_covariance * up)) {
    return observation;
  }

  observation.height_m = detection.position_m.z();
  const Eigen::Matrix2d arm = observation.height_m * level_displacement();
  observation.covariance_m2 = model::without_level(whole, arm, *level_covariance);
  return observation;
}

/// Common change of height of known landmarks relative to the vehicle, smoothed [m].
double common_rise(const FilterState& state, std::span<const Pairing> levelled,
                   const ScanUpdate& update) {
  if (levelled.empty() || has_ground_marks(state)) return 0.0;
  std::vector<double> changes;
  for (const Pairing& pairing : levelled) {
    changes.push_back(update.observations[pairing.observation].height_m -
                      state.landmarks()[pairing.landmark].height_m);
  }
  const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
  std::nth_element(changes.begin(), middle, changes.end());
  return kRiseGain * *middle;
}

}  // namespace

ScanUpdate read_scan(const model::TrackedScan& scan,
                     const std::optional<Eigen::Matrix2d>& level_covariance) {
  ScanUpdate update;
  for (std::uint32_t i = 0; i < scan.landmarks.size(); ++i) {
    const model::TrackedLandmark& landmark = scan.landmarks[i];
    if (landmark.track_id == 0 || !is_usable(landmark.observed)) continue;
    update.observations.push_back(observation_of(landmark.observed, level_covariance));
    update.scan_index.push_back(i);
    update.tracks.push_back(landmark.track_id);
  }
  update.is_settled.assign(update.observations.size(), false);
  return update;
}

bool is_at_odds(const ScanUpdate& update) {
  return update.refused >= kFewRefused && update.refused > 2 * update.used;
}

void steady_heights(FilterState& state, std::span<const Pairing> known, ScanUpdate& update) {
  std::vector<Pairing> levelled;
  for (const Pairing& pairing : known) {
    if (update.observations[pairing.observation].height_m == 0.0) continue;
    if (state.landmarks()[pairing.landmark].height_m == 0.0) continue;
    levelled.push_back(pairing);
  }

  const double rise = common_rise(state, levelled, update);
  for (std::size_t i = 0; i < state.landmarks().size(); ++i) {
    MapLandmark& landmark = state.landmark(i);
    if (landmark.height_m != 0.0) landmark.height_m += rise;
  }

  for (const Pairing& pairing : levelled) {
    update.observations[pairing.observation].height_m =
        state.landmarks()[pairing.landmark].height_m;
  }
}

}  // namespace understory::ekf
