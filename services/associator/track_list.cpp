#include "services/associator/track_list.hpp"

#include <algorithm>
#include <bit>

#include "services/associator/motion_check.hpp"

namespace understory::associator {
namespace {

/// Largest weight of a track's mean [observations]: older ones fade, so that the drift of `local`
/// does not blur it.
constexpr double kMaxWeight = 24.0;
/// Margin for the blurred edge of the field of view.
constexpr double kEdge_m = 1.0;
/// This number of stationary tracks determines the vehicle's motion, whatever the other tracks do.
constexpr std::size_t kEnoughStationary = 3;

/// The scans that decide whether a track is consistent, as a mask of Track::history.
std::uint64_t window_mask(unsigned window) { return (std::uint64_t{1} << window) - 1; }

}  // namespace

double Track::variance_m2() const {
  return detection_variance_m2 / std::min<double>(std::max(1u, observations), kMaxWeight);
}

void TrackList::check_steadiness(std::span<const Observation> observations,
                                 std::span<const Match> matches, model::Utime utime,
                                 const MotionSince& motion_since) {
  std::size_t stationary = 0;
  bool is_measured = false;
  for (const Match& match : matches) {
    Track& track = tracks_[match.track];
    const Observation& now = observations[match.observation];
    const ReferenceObservation fresh{utime, now.position_m, now.covariance_m2};
    const auto motion = motion_since(track.reference.utime);
    if (!motion) {
      track.reference = fresh;
    } else if (!match.ambiguous) {
      const double seconds = 1e-6 * static_cast<double>(utime - track.reference.utime);
      is_measured = true;
      check_motion(track, now, {seconds, *motion}, parameters_);
      if (seconds > kMaxComparison_s) track.reference = fresh;
    }
    if (track.steadiness == Steadiness::kStationary) ++stationary;
  }

  requires_proof_ = is_measured && stationary < kEnoughStationary;
}

std::vector<model::TrackId> TrackList::update(std::span<const Observation> observations,
                                              std::span<const Match> matches,
                                              const geometry::SE2& local_T_vehicle,
                                              const model::FieldOfView& view, model::Utime utime) {
  std::vector<model::TrackId> published(observations.size(), 0);
  std::vector<std::uint8_t> matched(tracks_.size(), 0);
  std::vector<std::uint8_t> used(observations.size(), 0);
  for (const Match& match : matches) matched[match.track] = used[match.observation] = 1;
  age(matched, local_T_vehicle.inverse(), view);

  // Matched tracks. An ambiguous match does not update its track: the observation may be of another
  // one.
  for (const Match& match : matches) {
    if (match.ambiguous) continue;
    Track& track = tracks_[match.track];
    take(track, observations[match.observation], local_T_vehicle);
    const bool counts = track.id != 0 || !stands_in(track, matched);
    if (counts) track.history |= 1u;
    confirm(track);
    if (counts && is_steady(track)) published[match.observation] = track.id;
  }

  // The other observations begin tracks.
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (used[i]) continue;
    Track& track = begin(observations[i], local_T_vehicle, utime);
    confirm(track);
    if (is_steady(track)) published[i] = track.id;
  }

  drop_excess(matched);
  drop(local_T_vehicle, view);
  return published;
}

/// Counts the scan for each track that it matches or has in view.
void TrackList::age(std::span<const std::uint8_t> matched, const geometry::SE2& vehicle_T_local,
                    const model::FieldOfView& view) {
  model::FieldOfView inner = view;
  inner.max_range_m -= kEdge_m;
  for (std::size_t i = 0; i < matched.size(); ++i) {
    Track& track = tracks_[i];
    if (!matched[i] && !inner.contains(vehicle_T_local * track.position_m)) continue;
    track.history <<= 1;
    ++track.age;
    track.missed = matched[i] ? 0 : track.missed + 1;
  }
}

void TrackList::take(Track& track, const Observation& observation,
                     const geometry::SE2& local_T_vehicle) {
  ++track.observations;
  const double weight = std::min<double>(track.observations, kMaxWeight);
  track.position_m += (local_T_vehicle * observation.position_m - track.position_m) / weight;
  track.detection_variance_m2 += (observation.variance_m2() - track.detection_variance_m2) / weight;
  track.radius_m += (observation.radius_m - track.radius_m) / weight;
}

Track& TrackList::begin(const Observation& observation, const geometry::SE2& local_T_vehicle,
                        model::Utime utime) {
  Track& track = tracks_.emplace_back();
  track.number = next_number_++;
  track.position_m = local_T_vehicle * observation.position_m;
  track.detection_variance_m2 = observation.variance_m2();
  track.radius_m = observation.radius_m;
  track.kind = observation.kind;
  track.observations = track.age = 1;
  track.history = 1;
  track.reference = {utime, observation.position_m, observation.covariance_m2};
  return track;
}

/// With very few stationary tracks in view, the vehicle's motion would follow a moving one.
bool TrackList::is_steady(const Track& track) const {
  if (parameters_.walking_mps <= 0.0) return true;
  return track.steadiness == Steadiness::kStationary ||
         (track.steadiness == Steadiness::kUnknown && !requires_proof_);
}

/// Whether a young track lies within the noise of a consistent one that was not matched: then the
/// observation is probably an outlier of the consistent one.
bool TrackList::stands_in(const Track& track, std::span<const std::uint8_t> matched) const {
  for (std::size_t i = 0; i < matched.size(); ++i) {
    const Track& other = tracks_[i];
    if (matched[i] || other.id == 0 || other.kind != track.kind) continue;
    const double gate2 = 2.0 * parameters_.gate_sigmas * parameters_.gate_sigmas *
                         (other.detection_variance_m2 + track.detection_variance_m2);
    if ((other.position_m - track.position_m).squaredNorm() < gate2) return true;
  }
  return false;
}

void TrackList::confirm(Track& track) {
  if (track.id != 0) return;
  const auto window = static_cast<unsigned>(std::clamp(parameters_.confirm_window, 1, 63));
  const std::uint64_t recent = track.history & window_mask(window);
  if (std::popcount(recent) >= parameters_.confirm_matches) track.id = next_id_++;
}

/// Beyond kMostTracks the oldest unmatched tracks are removed.
void TrackList::drop_excess(std::span<const std::uint8_t> matched) {
  if (tracks_.size() <= kMostTracks) return;
  std::size_t excess = tracks_.size() - kMostTracks;
  std::size_t next = 0;
  std::erase_if(tracks_, [&](const Track&) {
    const std::size_t i = next++;
    const bool goes = excess > 0 && i < matched.size() && !matched[i];
    if (goes) --excess;
    return goes;
  });
}

void TrackList::drop(const geometry::SE2& local_T_vehicle, const model::FieldOfView& view) {
  const double range = parameters_.keep_range_factor * view.max_range_m;
  const auto window = static_cast<unsigned>(std::clamp(parameters_.confirm_window, 1, 63));
  const std::uint64_t mask = window_mask(window);

  std::erase_if(tracks_, [&](const Track& track) {
    if ((track.position_m - local_T_vehicle.translation()).norm() > range) return true;
    if (track.id != 0) return track.missed > static_cast<std::uint32_t>(parameters_.max_missed);
    // Missed too often to become consistent within the window.
    const int possible = static_cast<int>(std::min(track.age, window));
    return possible - std::popcount(track.history & mask) >
           parameters_.confirm_window - parameters_.confirm_matches;
  });
}

}  // namespace understory::associator
