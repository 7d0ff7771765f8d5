#include "services/associator/associator.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/model/archive.hpp"

namespace understory::associator {
namespace {

constexpr state::Format kFormat{"associator", 5};

geometry::SE2WithCovariance pose_of(const Localisation& located) {
  return {located.pose.reference_T_observed, located.pose.covariance};
}

}  // namespace

Associator::Associator(const AssociatorParameters& parameters)
    : parameters_(parameters), tracks_(parameters), noise_(parameters.noise), motion_(parameters) {
  for (const char* name : {"auto", "nearest", "registered", "consistent"}) {
    if (parameters.method == name) return;
  }
  throw std::invalid_argument("associator: method '" + parameters.method +
                              "' is not one of auto, nearest, registered, consistent");
}

std::optional<model::TrackedScan> Associator::add(const model::LandmarkScan& stated) {
  ++counters_.scans;
  counters_.detections += stated.detections.size();
  if (!is_in_time(stated)) return std::nullopt;

  const model::LandmarkScan scan = noise_.corrected(stated);
  std::vector<Observation> observations = usable_observations(scan);
  counters_.detections_unusable += scan.detections.size() - observations.size();

  // Pose of the vehicle in the frame of the tracks.
  Localisation located = locate(observations, scan);
  if (!located.fits) locate_rescaled(stated, observations, located);
  if (!located.fits) {
    if (pass_over()) return tracked_scan({}, {}, scan);
    ++counters_.scans_lost;
    tracks_.clear();
  }
  misfits_ = 0;

  // Association of observations and tracks.
  const geometry::SE2WithCovariance pose = pose_of(located);
  const auto matches = match(tracks_.tracks(), observations, pose, parameters_);

  // Updates the noise, the vehicle's motion and the tracks.
  noise_.add(stated, numbers_of(observations, matches, stated));
  motion_.set_scan(scan.utime, local_T_vehicle_.inverse() * pose.mean);
  local_T_vehicle_ = pose.mean;
  const auto ids = update_tracks(observations, matches, scan);

  return tracked_scan(observations, ids, noise_.corrected(stated));
}

/// With stated covariances that are far too small or large no scan fits. Replaces observations and
/// result if the scan fits with other noise.
void Associator::locate_rescaled(const model::LandmarkScan& stated,
                                 std::vector<Observation>& observations, Localisation& located) {
  for (const double factor : noise_.tries()) {
    auto rescaled = usable_observations(model::DetectionNoise::rescaled(stated, factor));
    Localisation tried = locate(rescaled, stated);
    if (!tried.fits) continue;

    const auto matches = match(tracks_.tracks(), rescaled, pose_of(tried), parameters_);
    if (!noise_.explains(stated, numbers_of(rescaled, matches, stated), factor)) continue;
    observations = std::move(rescaled);
    located = std::move(tried);
    return;
  }
}

/// The number of each detection's track; an unmatched observation gets the number of a new track.
std::vector<std::uint64_t> Associator::numbers_of(const std::vector<Observation>& observations,
                                                  const std::vector<Match>& matches,
                                                  const model::LandmarkScan& scan) const {
  std::vector<std::uint64_t> numbers(scan.detections.size(), 0);
  std::vector<std::uint8_t> is_matched(observations.size(), 0);
  for (const Match& match : matches) {
    is_matched[match.observation] = 1;
    if (match.ambiguous) continue;
    numbers[observations[match.observation].detection] = tracks_.tracks()[match.track].number;
  }

  std::uint64_t next = tracks_.next_number();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (is_matched[i] == 0) numbers[observations[i].detection] = next++;
  }
  return numbers;
}

bool Associator::is_in_time(const model::LandmarkScan& scan) {
  const auto& last = motion_.last_scan();
  if (!last || scan.utime > *last) return true;
  if (scan.utime < *last - kClockJump_us) {
    counters_.last_reason = "the clock jumped back";
    tracks_.clear();
    motion_.forget_scan();
    return true;
  }

  ++counters_.scans_refused;
  counters_.last_reason = "scan is late or came twice";
  return false;
}

/// The first scan defines the frame `local`.
Localisation Associator::locate(const std::vector<Observation>& observations,
                                const model::LandmarkScan& scan) {
  if (!motion_.last_scan()) return {};

  const PredictedMotion predicted = motion_.predict(scan.utime);
  const geometry::SE2WithCovariance guess{local_T_vehicle_ * predicted.last_T_now.mean,
                                          predicted.last_T_now.covariance};

  return associator::locate(tracks_.tracks(), observations, scan.field_of_view, guess, parameters_);
}

/// After passing traffic or a burst of false detections the next scan is likely to fit; the
/// disappearance of all landmarks is less likely (docs/decisions/041-scans-that-fit-no-track.md).
bool Associator::pass_over() {
  counters_.last_reason = "a scan fitted no track";
  if (tracks_.tracks().empty() || ++misfits_ > parameters_.max_misfits) return false;
  ++counters_.scans_passed_over;
  return true;
}

std::vector<model::TrackId> Associator::update_tracks(const std::vector<Observation>& observations,
                                                      const std::vector<Match>& matches,
                                                      const model::LandmarkScan& scan) {
  if (parameters_.walking_mps > 0.0) {
    tracks_.check_steadiness(observations, matches, scan.utime, [&](model::Utime then_utime) {
      return motion_.by_wheels(then_utime, scan.utime);
    });
  }

  auto ids =
      tracks_.update(observations, matches, local_T_vehicle_, scan.field_of_view, scan.utime);
  counters_.ambiguous += static_cast<std::uint64_t>(
      std::ranges::count_if(matches, [](const Match& match) { return match.ambiguous; }));
  return ids;
}

model::TrackedScan Associator::tracked_scan(const std::vector<Observation>& observations,
                                            const std::vector<model::TrackId>& ids,
                                            const model::LandmarkScan& scan) {
  model::TrackedScan tracked{scan.utime, next_sequence_++, scan.field_of_view, {}};
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (ids[i] == 0) continue;
    const std::uint32_t detection = observations[i].detection;
    tracked.landmarks.push_back({ids[i], detection, scan.detections[detection]});
  }
  counters_.published += tracked.landmarks.size();
  return tracked;
}

std::string Associator::save() const { return state::save(kFormat, *this); }

void Associator::load(const std::string& bytes) {
  Associator loaded(parameters_);
  state::load(bytes, kFormat, loaded);
  loaded.counters_ = counters_;
  *this = std::move(loaded);
}

}  // namespace understory::associator
