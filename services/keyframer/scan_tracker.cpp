#include "services/keyframer/scan_tracker.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace understory::keyframer {
namespace {

/// A track's mean forgets after so many sightings, so that slow drift of `local` does not smear it.
constexpr double kMaxWeight = 24.0;
/// A track seen less often may be an outlier of its neighbour: it takes a detection only if that is
/// e^4 times likelier.
constexpr std::uint32_t kConfirmed = 4;
constexpr double kReluctance = 8.0;
constexpr std::size_t kMaxMergeMemory = 4096;
constexpr double kMaxMergeDistance2 = 4.0;  // m^2

std::vector<geometry::UncertainPoint> observed_points(const model::LandmarkScan& scan) {
  std::vector<geometry::UncertainPoint> points;
  points.reserve(scan.detections.size());
  for (const model::Detection& detection : scan.detections) {
    points.push_back({detection.position_m.head<2>(), plane_variance(detection)});
  }
  return points;
}

std::vector<geometry::UncertainPoint> reference_points(std::span<const Track> tracks) {
  std::vector<geometry::UncertainPoint> points;
  points.reserve(tracks.size());
  for (const Track& track : tracks) {
    const double weight = std::min<double>(track.observations, kMaxWeight);
    points.push_back({track.position_m, track.detection_variance_m2 / weight,
                      track.observations < kConfirmed ? kReluctance : 0.0});
  }
  return points;
}

}  // namespace

double plane_variance(const model::Detection& detection) {
  return 0.5 * detection.covariance_m2.topLeftCorner<2, 2>().trace();
}

FollowedScan ScanTracker::restart(const model::LandmarkScan& scan) {
  tracks_.clear();
  merged_.clear();
  started_ = true;
  local_T_vehicle_ = geometry::SE2();
  last_motion_ = geometry::SE2();
  return fuse(scan, geometry::Registration{geometry::SE2(), Eigen::Matrix3d::Zero(), {}});
}

FollowedScan ScanTracker::add(const model::LandmarkScan& scan,
                              const std::optional<geometry::SE2WithCovariance>& motion) {
  if (!started_) return restart(scan);
  const std::optional<geometry::Registration> registration = locate(scan, motion);
  if (!registration) return {};
  last_motion_ = local_T_vehicle_.inverse() * registration->reference_T_observed;
  local_T_vehicle_ = registration->reference_T_observed;
  return fuse(scan, *registration);
}

bool ScanTracker::fits(const geometry::Registration& registration,
                       const model::LandmarkScan& scan) const {
  const geometry::SE2 vehicle_T_local = registration.reference_T_observed.inverse();
  std::size_t visible = 0;
  for (const Track& track : tracks_) {
    if (track.observations >= 2 &&
        scan.field_of_view.contains(vehicle_T_local * track.position_m)) {
      ++visible;
    }
  }
  // A rolling map of one scan has no track seen twice: then its size is what can be matched.
  const std::size_t known = visible > 0 ? visible : tracks_.size();
  const double possible = static_cast<double>(std::min(scan.detections.size(), known));
  return static_cast<double>(registration.pairs.size()) >=
             parameters_.min_matched_ratio * possible &&
         registration.pairs.size() >= static_cast<std::size_t>(parameters_.min_matched);
}

std::optional<geometry::Registration> ScanTracker::locate(
    const model::LandmarkScan& scan,
    const std::optional<geometry::SE2WithCovariance>& motion) const {
  const std::vector<geometry::UncertainPoint> reference = reference_points(tracks_);
  const std::vector<geometry::UncertainPoint> observed = observed_points(scan);
  geometry::RegistrationParameters registration;
  registration.gate_sigmas = parameters_.gate_sigmas;
  if (motion) {
    const geometry::SE2WithCovariance guess{
        local_T_vehicle_ * motion->mean, motion->covariance + 1e-8 * Eigen::Matrix3d::Identity()};
    return register_points(reference, observed, guess, registration);
  }
  const geometry::StepModel step{parameters_.motion_sigma_m, parameters_.motion_sigma_rad,
                                 parameters_.max_rotation_rad};
  geometry::Registration found =
      register_step(reference, observed, local_T_vehicle_, last_motion_, step, registration,
                    [&](const geometry::Registration& tried) { return fits(tried, scan); });
  if (!fits(found, scan)) return std::nullopt;
  return found;
}

FollowedScan ScanTracker::fuse(const model::LandmarkScan& scan,
                               const geometry::Registration& registration) {
  FollowedScan result{true, local_T_vehicle_, {}};
  result.tracks.assign(scan.detections.size(), 0);
  update_visibility(scan);
  for (const geometry::PointPair& pair : registration.pairs) {
    const model::Detection& detection = scan.detections[pair.observed];
    Track& track = tracks_[pair.reference];
    ++track.observations;
    track.seen |= 1u;
    track.in_view |= 1u;
    const double weight = std::min<double>(track.observations, kMaxWeight);
    const Eigen::Vector2d position =
        local_T_vehicle_ * Eigen::Vector2d(detection.position_m.head<2>());
    track.position_m += (position - track.position_m) / weight;
    track.detection_variance_m2 +=
        (plane_variance(detection) - track.detection_variance_m2) / weight;
    track.radius_m += (detection.radius_m - track.radius_m) / weight;
    result.tracks[pair.observed] = track.id;
  }
  for (std::size_t i = 0; i < scan.detections.size(); ++i) {
    if (result.tracks[i] != 0) continue;
    const model::Detection& detection = scan.detections[i];
    Track track;
    track.id = next_id_++;
    track.position_m = local_T_vehicle_ * Eigen::Vector2d(detection.position_m.head<2>());
    track.detection_variance_m2 = plane_variance(detection);
    track.radius_m = detection.radius_m;
    track.kind = detection.kind;
    track.observations = 1;
    track.seen = track.in_view = 1;
    result.tracks[i] = track.id;
    tracks_.push_back(track);
  }
  merge_doubles();
  drop_distant(scan);
  return result;
}

void ScanTracker::update_visibility(const model::LandmarkScan& scan) {
  const geometry::SE2 vehicle_T_local = local_T_vehicle_.inverse();
  for (Track& track : tracks_) {
    const bool visible = scan.field_of_view.contains(vehicle_T_local * track.position_m);
    track.seen <<= 1;
    track.in_view = (track.in_view << 1) | (visible ? 1u : 0u);
  }
}

bool ScanTracker::within_noise(const Track& a, const Track& b) const {
  const double variance = std::max(a.detection_variance_m2, b.detection_variance_m2);
  const double gate2 = parameters_.gate_sigmas * parameters_.gate_sigmas * variance;
  return (a.position_m - b.position_m).squaredNorm() <= std::min(gate2, kMaxMergeDistance2);
}

bool ScanTracker::doubtful(const Track& track) const {
  for (const Track& older : tracks_) {
    if (older.id >= track.id) break;
    if (within_noise(older, track) && (older.seen & track.seen) == 0) return true;
  }
  return false;
}

/// Two tracks that lie within the noise of each other and, over six scans or more that had both in
/// view, were never detected together are one landmark: two trunks with detection probability 0.8
/// do that once in 500 times.
void ScanTracker::merge_doubles() {
  for (std::size_t young = 1; young < tracks_.size(); ++young) {
    const Track& b = tracks_[young];
    if (b.observations < 2 || std::popcount(b.in_view) < 6) continue;
    for (std::size_t old = 0; old < young; ++old) {
      Track& a = tracks_[old];
      if (!within_noise(a, b)) continue;
      if ((a.seen & b.seen) != 0 || std::popcount(a.in_view & b.in_view) < 6) continue;
      absorb(a, b);
      tracks_.erase(tracks_.begin() + static_cast<std::ptrdiff_t>(young));
      --young;
      break;
    }
  }
  if (merged_.size() > kMaxMergeMemory) {
    merged_.erase(merged_.begin(), merged_.begin() + kMaxMergeMemory / 2);
  }
}

void ScanTracker::absorb(Track& a, const Track& b) {
  const double na = std::min<double>(a.observations, kMaxWeight);
  const double nb = std::min<double>(b.observations, kMaxWeight);
  a.position_m = (na * a.position_m + nb * b.position_m) / (na + nb);
  a.observations += b.observations;
  a.seen |= b.seen;
  a.in_view |= b.in_view;
  merged_.emplace_back(b.id, a.id);
}

void ScanTracker::drop_distant(const model::LandmarkScan& scan) {
  const double limit = 1.5 * scan.field_of_view.max_range_m;
  std::erase_if(tracks_, [&](const Track& track) {
    const bool distant = (track.position_m - local_T_vehicle_.translation()).norm() > limit;
    // Seen once and not in the sixteen views since: noise.
    const bool noise = track.observations < 2 && std::popcount(track.in_view) > 16;
    return distant || noise;
  });
}

std::uint32_t ScanTracker::resolved(std::uint32_t id) const {
  for (const auto& [from, to] : merged_) {
    if (from == id) id = to;
  }
  return id;
}

const Track* ScanTracker::find(std::uint32_t id) const {
  const auto found =
      std::lower_bound(tracks_.begin(), tracks_.end(), id,
                       [](const Track& track, std::uint32_t key) { return track.id < key; });
  return found != tracks_.end() && found->id == id ? &*found : nullptr;
}

ScanTracker::State ScanTracker::state() const {
  return {tracks_, merged_, next_id_, started_, local_T_vehicle_, last_motion_};
}

void ScanTracker::set_state(const State& state) {
  tracks_ = state.tracks;
  merged_ = state.merged;
  next_id_ = state.next_id;
  started_ = state.started;
  local_T_vehicle_ = state.local_T_vehicle;
  last_motion_ = state.last_motion;
}

}  // namespace understory::keyframer
