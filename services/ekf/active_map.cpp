#include "services/ekf/active_map.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "services/ekf/ground_marks.hpp"

namespace understory::ekf {
namespace {

/// The new landmark of observation `k`.
MapLandmark new_landmark(const ScanUpdate& update, std::size_t k,
                         const model::Detection& detection) {
  MapLandmark landmark;
  landmark.id = update.tracks[k];
  landmark.radius_m = std::isfinite(detection.radius_m) ? detection.radius_m : 0.0;
  landmark.kind = detection.kind;
  landmark.observation_count = 1;
  landmark.views = 1.0;
  landmark.observed_variance_m2 = 0.5 * update.observations[k].covariance_m2.trace();
  landmark.height_m = update.observations[k].height_m;
  return landmark;
}

}  // namespace

/// The correlated part is modelled as white noise of the same power over many scans: its variance
/// times (1 + r) / (1 - r), with the correlation r from scan to scan. While the vehicle is
/// stationary it is not added (StationaryMonitor::leave_place()).
void ActiveMap::weaken(const Pairing& pairing, double distance_m, FilterState& state,
                       ScanUpdate& update) const {
  MapLandmark& landmark = state.landmark(pairing.landmark);
  Observation& observation = update.observations[pairing.observation];
  const double moved = distance_m - landmark.observed_at_m;
  landmark.observed_at_m = distance_m;
  landmark.observed_variance_m2 = 0.5 * observation.covariance_m2.trace();

  if (has_ground_marks(state)) {
    landmark.views = 1.0;
    return;
  }
  landmark.views = 1.0 + landmark.views * std::exp(-moved / observation_.correlation_m);
  observation.covariance_m2 *= 1.0 + 2.0 * observation_.correlated_share * (landmark.views - 1.0);
}

void ActiveMap::count_observed(const model::TrackedScan& scan, const Pairing& pairing,
                               FilterState& state, ScanUpdate& update) const {
  update.is_settled[pairing.observation] = true;
  MapLandmark& landmark = state.landmark(pairing.landmark);
  const model::Detection& detection = update.detection(scan, pairing.observation);
  ++landmark.observation_count;
  landmark.missed = 0;
  landmark.refused = 0;
  landmark.last_scan = scan_number_;
  if (std::isfinite(detection.radius_m)) {
    landmark.radius_m += (detection.radius_m - landmark.radius_m) / landmark.observation_count;
  }
}

void ActiveMap::rejoin(const model::TrackedScan& scan, const Pairing& pairing, FilterState& state,
                       ScanUpdate& update) {
  aliases_.set(update.tracks[pairing.observation], state.landmarks()[pairing.landmark].id);
  count_observed(scan, pairing, state, update);
}

void ActiveMap::add_new(const model::TrackedScan& scan, double distance_m, const ScanUpdate& update,
                        FilterState& state, EkfCounters& counters) {
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  bool is_full = false;
  for (std::size_t k = 0; k < update.observations.size(); ++k) {
    if (update.is_settled[k] || aliases_.landmark_of(state, update.tracks[k])) continue;

    const Observation& observation = update.observations[k];
    const Eigen::Vector2d displaced = observation.height_m * level_displacement() * state.level;
    const Eigen::Vector2d position =
        state.position + rotation * (observation.position_m - displaced);
    const bool is_too_near = is_full || is_near_old(state, position);
    if (!is_too_near) is_full = !make_room(scan.field_of_view, state, counters);
    if (is_too_near || is_full) {
      ++counters.landmarks_too_near;
      continue;
    }

    MapLandmark landmark = new_landmark(update, k, update.detection(scan, k));
    landmark.observed_at_m = distance_m;
    landmark.last_scan = scan_number_;
    state.add_landmark(landmark, observation.position_m, observation.covariance_m2,
                       observation.height_m);
    aliases_.set(landmark.id, landmark.id);
  }
}

void ActiveMap::count_missed(const model::FieldOfView& view, FilterState& state) const {
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();
  for (std::size_t i = 0; i < state.landmarks().size(); ++i) {
    MapLandmark& landmark = state.landmark(i);
    if (landmark.is_ground_mark() || landmark.last_scan == scan_number_) continue;
    if (view.contains(back * (landmark.position - state.position))) ++landmark.missed;
  }
}

void ActiveMap::remove_stale(const model::FieldOfView& view, FilterState& state,
                             EkfCounters& counters) {
  const double range = map_.keep_range_factor * view.max_range_m;
  for (std::size_t i = state.landmarks().size(); i-- > 0;) {
    const MapLandmark& landmark = state.landmarks()[i];
    if (landmark.is_ground_mark()) continue;
    const bool is_distant = (landmark.position - state.position).norm() > range;
    const bool is_gone = landmark.missed > static_cast<std::uint32_t>(map_.max_missed);
    const bool is_wrong = landmark.refused >= static_cast<std::uint32_t>(map_.max_refused);
    if (is_distant || is_gone || is_wrong) remove(i, state, counters);
  }
}

bool ActiveMap::is_near_old(const FilterState& state, const Eigen::Vector2d& position) const {
  const double limit = map_.min_separation_m * map_.min_separation_m;
  return std::ranges::any_of(state.landmarks(), [&](const MapLandmark& landmark) {
    return !landmark.is_ground_mark() && (landmark.position - position).squaredNorm() < limit;
  });
}

/// Whether a landmark may be added. A landmark observed by this scan is not removed to make room
/// for another one of it.
bool ActiveMap::make_room(const model::FieldOfView& view, FilterState& state,
                          EkfCounters& counters) {
  const auto& landmarks = state.landmarks();
  const int marks = has_ground_marks(state) ? kGroundMarks : 0;
  if (static_cast<int>(landmarks.size()) - marks < map_.max_landmarks) return true;

  std::optional<std::size_t> oldest;
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].is_ground_mark() || landmarks[i].last_scan == scan_number_) continue;
    if (view.contains(back * (landmarks[i].position - state.position))) continue;
    if (!oldest || landmarks[i].last_scan < landmarks[*oldest].last_scan) oldest = i;
  }
  if (oldest) remove(*oldest, state, counters);
  return oldest.has_value();
}

void ActiveMap::remove(std::size_t landmark, FilterState& state, EkfCounters& counters) {
  const model::TrackId id = state.landmarks()[landmark].id;
  state.remove_landmark(landmark);
  aliases_.forget_landmark(id);
  ++counters.removed;
}

}  // namespace understory::ekf
