#include "services/associator/track_list.hpp"

#include <algorithm>
#include <bit>
#include <memory>

#include "services/associator/motion_check.hpp"

namespace understory::associator {
namespace {

/// A track's mean forgets after so many sightings, so that slow drift of `local` does not smear it.
constexpr double kMaxWeight = 24.0;
/// The edge of the field of view is not sharp [m].
constexpr double kEdge_m = 1.0;
/// So many that stand tell the vehicle's motion whatever others do.
constexpr std::size_t kEnough = 3;

}  // namespace

double Track::variance_m2() const {
  return detection_variance_m2 / std::min<double>(std::max(1u, observations), kMaxWeight);
}

std::vector<model::TrackId> TrackList::update(std::span<const Seen> seen,
                                              std::span<const Match> matches,
                                              const geometry::SE2& local_T_vehicle,
                                              const model::FieldOfView& view, model::Utime utime) {
  const geometry::SE2 vehicle_T_local = local_T_vehicle.inverse();
  const std::size_t known = tracks_.size();
  const auto matched = std::make_unique<bool[]>(known);
  std::vector<bool> used(seen.size(), false);
  for (const Match& match : matches) {
    matched[match.track] = true;
    used[match.seen] = true;
  }
  model::FieldOfView inner = view;
  inner.max_range_m -= kEdge_m;
  for (std::size_t i = 0; i < known; ++i) {
    Track& track = tracks_[i];
    if (!matched[i] && !inner.contains(vehicle_T_local * track.position_m)) continue;
    track.history <<= 1;
    ++track.age;
    track.missed = matched[i] ? 0 : track.missed + 1;
  }
  std::vector<model::TrackId> published(seen.size(), 0);
  for (const Match& match : matches) {
    Track& track = tracks_[match.track];
    take(track, seen[match.seen], match, local_T_vehicle);
    if (match.ambiguous) continue;
    const bool counts = track.id != 0 || !stands_in(track, {matched.get(), known});
    if (counts) track.history |= 1u;
    confirm(track);
    if (counts && is_steady(track)) published[match.seen] = track.id;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (used[i]) continue;
    Track& track = tracks_.emplace_back();
    track.position_m = local_T_vehicle * seen[i].position_m;
    track.detection_variance_m2 = seen[i].variance_m2();
    track.radius_m = seen[i].radius_m;
    track.kind = seen[i].kind;
    track.observations = track.age = 1;
    track.history = 1;
    track.begin = {utime, seen[i].position_m, seen[i].covariance_m2};
    confirm(track);
    if (is_steady(track)) published[i] = track.id;
  }
  drop(local_T_vehicle, view);
  return published;
}

void TrackList::check_steadiness(
    std::span<const Seen> seen, std::span<const Match> matches, model::Utime utime,
    const std::function<std::optional<geometry::SE2WithCovariance>(model::Utime)>& motion_since) {
  std::size_t standing = 0;
  bool is_known = false;
  for (const Match& match : matches) {
    Track& track = tracks_[match.track];
    const Seen& now = seen[match.seen];
    if (const auto motion = motion_since(track.begin.utime); motion && !match.ambiguous) {
      const double way_s = 1e-6 * static_cast<double>(utime - track.begin.utime);
      is_known = true;
      check_motion(track, now, {way_s, *motion}, parameters_);
      if (way_s > kCompared_s) track.begin = {utime, now.position_m, now.covariance_m2};
    } else if (!motion) {
      track.begin = {utime, now.position_m, now.covariance_m2};
    }
    if (track.steadiness == Steadiness::kStationary) ++standing;
  }
  needs_proof_ = is_known && standing < kEnough;
}

/// Where hardly anything stands in view, the vehicle's motion would be told by one that walks.
bool TrackList::is_steady(const Track& track) const {
  if (parameters_.walking_mps <= 0.0) return true;
  return track.steadiness == Steadiness::kStationary ||
         (track.steadiness == Steadiness::kUnknown && !needs_proof_);
}

void TrackList::take(Track& track, const Seen& seen, const Match& match,
                     const geometry::SE2& local_T_vehicle) {
  if (match.ambiguous) return;  // Whose position it is cannot be told.
  ++track.observations;
  const double weight = std::min<double>(track.observations, kMaxWeight);
  track.position_m += (local_T_vehicle * seen.position_m - track.position_m) / weight;
  track.detection_variance_m2 += (seen.variance_m2() - track.detection_variance_m2) / weight;
  track.radius_m += (seen.radius_m - track.radius_m) / weight;
}

/// A young track within the noise of a consistent one that was not matched itself: the detection
/// is likely the other's, an outlier.
bool TrackList::stands_in(const Track& track, std::span<const bool> matched) const {
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
  const std::uint64_t recent = track.history & ((std::uint64_t{1} << window) - 1);
  if (std::popcount(recent) >= parameters_.confirm_matches) track.id = next_id_++;
}

void TrackList::drop(const geometry::SE2& local_T_vehicle, const model::FieldOfView& view) {
  const double range = parameters_.keep_range_factor * view.max_range_m;
  const auto window = static_cast<unsigned>(std::clamp(parameters_.confirm_window, 1, 63));
  const std::uint64_t mask = (std::uint64_t{1} << window) - 1;
  std::erase_if(tracks_, [&](const Track& track) {
    if ((track.position_m - local_T_vehicle.translation()).norm() > range) return true;
    if (track.id != 0) return track.missed > static_cast<std::uint32_t>(parameters_.max_missed);
    // Too often missed to become consistent.
    const int possible = static_cast<int>(std::min(track.age, window));
    return possible - std::popcount(track.history & mask) >
           parameters_.confirm_window - parameters_.confirm_matches;
  });
}

}  // namespace understory::associator
