#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr state::Format kFormat{"geoslam_mapper.smoothing", 29};
constexpr state::Format kCopyFormat{"geoslam_mapper.smoothing.copy", 1};
/// Two keyframes contradict each other if their motion in a trial map differs from the tracked one
/// by more than this number of standard deviations.
constexpr double kTrackSigmas = 4.0;
/// Number of successive keyframes contradicting the map in use, at which it is no longer trusted:
/// they may agree with each other.
constexpr std::uint32_t kContradicted = 8;
/// Map numbers stay positive in the 16 bit that landmark ids have for them.
constexpr std::uint32_t kMostMaps = 0x7fff;

bool is_finite(const model::Keyframe& keyframe) {
  const auto is_good = [](const model::KeyframeLandmark& l) {
    return l.position_m.allFinite() && l.covariance_m2.allFinite() &&
           l.covariance_m2.determinant() > 0.0 && l.covariance_m2.trace() > 0.0;
  };
  const auto is_good_member = [](const model::KeyframeMember& m) {
    return m.centre_T_vehicle.coordinates().allFinite() && m.covariance.allFinite();
  };
  return std::all_of(keyframe.landmarks.begin(), keyframe.landmarks.end(), is_good) &&
         std::all_of(keyframe.members.begin(), keyframe.members.end(), is_good_member);
}

}  // namespace

SmoothingMapper::SmoothingMapper(const SmoothingMapperParameters& parameters)
    : parameters_(parameters), current_(parameters) {}

model::MapUpdate SmoothingMapper::add(const model::Keyframe& keyframe) {
  using enum model::MapUpdateStatus;
  if (auto reason = malformed(keyframe); !reason.empty()) {
    model::MapUpdate update;
    update.keyframe_sequence = keyframe.sequence;
    update.utime = keyframe.utime;
    update.map_id = current_.map().landmarks.map_id();
    update.reason = std::move(reason);
    return update;
  }
  last_utime_ = keyframe.utime;

  model::MapUpdate update = place(keyframe);
  units_.follow(current_.map_factor());
  return units_.metres(std::move(update));
}

/// Places it in the map in use, in another one, or in none.
model::MapUpdate SmoothingMapper::place(const model::Keyframe& keyframe) {
  using enum model::MapUpdateStatus;
  current_.may_hand_over(may_hand_over_);
  model::MapUpdate update = current_.add(keyframe);
  std::ranges::move(current_.take_given_away(), std::back_inserter(given_away_));
  count_contradictions(update);
  update.is_lost =
      contradictions_ >= kContradicted ||
      (update.status == kNotSure && (current_.map().empty() || !current_.reaches(keyframe)));
  if (may_try_another(update)) {
    try_another(keyframe, update);
  } else {
    trial_.reset();
  }
  update.is_provisional = current_.is_provisional();
  if (update.status == kUpdated && !update.is_provisional && !parameters_.localisation_only)
    rejoin_left_maps(keyframe, update);
  return update;
}

std::optional<ScanPose> SmoothingMapper::locate(const model::LandmarkScan& scan) {
  const auto pose = current_.locate(scan);
  return pose ? std::optional(units_.metres(*pose)) : std::nullopt;
}

/// A change of the units moves all landmarks.
std::vector<model::MapLandmark> SmoothingMapper::take_changed_landmarks() {
  std::vector<model::MapLandmark> changed =
      current_.take_changed_landmarks(kAroundVehicle_m / units_.factor());
  if (units_.take_step()) changed = current_.map().all_landmarks();
  return units_.metres(std::move(changed));
}

/// Keyframes that were not localised do not count.
void SmoothingMapper::count_contradictions(const model::MapUpdate& update) {
  using enum model::MapUpdateStatus;
  if (update.status == kRolledBack) ++contradictions_;
  if (update.status == kUpdated || update.status == kFirstMap) contradictions_ = 0;
}

std::string SmoothingMapper::malformed(const model::Keyframe& keyframe) const {
  if (keyframe.members.empty()) return "keyframe without members";
  if (last_utime_ && keyframe.utime <= *last_utime_) return "keyframe not later than the last one";
  if (!is_finite(keyframe))
    return "keyframe with a value that is not finite or a covariance that is not positive";
  return {};
}

/// A given map that must not change stays the only one. While odometry covers the motion since the
/// last keyframe in the map in use, that map is searched, too: another map would duplicate it.
bool SmoothingMapper::may_try_another(const model::MapUpdate& update) const {
  using enum model::MapUpdateStatus;
  const bool is_placed = update.status == kFirstMap || update.status == kUpdated;
  if (is_placed || current_.map().empty() || parameters_.localisation_only) return false;
  if (parameters_.new_map_keyframes == 0 || current_.map().landmarks.map_id() >= kMostMaps)
    return false;
  return current_.is_provisional() || update.is_lost;
}

/// Each keyframe continues the trial or begins a new one: the keyframes that agree are successive.
void SmoothingMapper::try_another(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const std::uint32_t id = current_.map().landmarks.map_id() + 1;
  model::MapUpdate tried;
  bool agree = false;
  if (trial_) {
    const auto map_T_previous_base = trial_->map_T_last_base();
    const bool had_landmarks = !trial_->map().landmarks.empty();
    tried = trial_->add(keyframe);
    agree = trial_->map().empty() || agrees(keyframe, tried, had_landmarks, map_T_previous_base);
  }
  if (!agree) {
    trial_ = std::make_unique<OneMap>(current_.beside(id));
    tried = trial_->add(keyframe);
  }
  if (trial_->is_provisional()) return;

  update = std::move(tried);
  adopt_trial(update);
}

/// Landmarks localised it at the pose of the keyframer's tracking. If a landmark needs two
/// keyframes, the first one leaves none, and odometry alone localises the second.
bool SmoothingMapper::agrees(
    const model::Keyframe& keyframe, const model::MapUpdate& update, bool had_landmarks,
    const std::optional<geometry::SE2WithCovariance>& map_T_previous_base) const {
  using enum model::MapUpdateStatus;
  if (update.status == kFirstMap) return true;
  if (update.status != kUpdated) return false;
  if (!had_landmarks) return true;
  if (update.inliers < static_cast<std::uint32_t>(parameters_.min_matched)) return false;
  if (!map_T_previous_base || !keyframe.previous_T_base) return true;

  const geometry::SE2 difference =
      (map_T_previous_base->mean * *keyframe.previous_T_base).inverse() * update.map_T_vehicle;
  return difference.translation().norm() <= kTrackSigmas * parameters_.predicted_sigma_m &&
         std::abs(difference.theta()) <= kTrackSigmas * parameters_.predicted_sigma_rad;
}

/// The update of the keyframe that brings the trial into use lists all of its landmarks.
void SmoothingMapper::adopt_trial(model::MapUpdate& update) {
  const std::uint32_t left = current_.map().landmarks.map_id();
  if (current_.is_provisional()) {
    update.reason =
        "map " + std::to_string(left) + " is dropped: no keyframe agreed with its first";
  } else {
    update.reason = (contradictions_ > 0 ? "contradicted" : "lost") +
                    (": map " + std::to_string(left)) + " is kept as it is";
    for (const std::uint32_t id : kept_maps_.add(current_.keep()))
      update.reason += ", map " + std::to_string(id) + " is forgotten";
  }
  current_ = std::move(*trial_);
  trial_.reset();
  rejoining_.reset();
  contradictions_ = 0;

  update.status = model::MapUpdateStatus::kFirstMap;
  update.added.clear();
  for (const auto& [id, landmark] : current_.map().landmarks.all()) update.added.push_back(id);
}

/// On a copy: if the two maps contradict each other, nothing changes.
void SmoothingMapper::rejoin_left_maps(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const auto overlap = rejoining_.follow(keyframe, update.associations, current_.map(), kept_maps_);
  if (!overlap) return;
  rejoining_.reset();

  const auto left = std::ranges::find(kept_maps_.maps(), overlap->map_id, &KeptMap::id);
  OneMap joined(parameters_);
  state::load(state::save(kCopyFormat, current_), kCopyFormat, joined);
  if (!joined.rejoin(opened(*left, parameters_), *overlap, update)) return;
  current_ = std::move(joined);
  kept_maps_.remove(overlap->map_id);
}

model::LoopResult SmoothingMapper::take(const model::LoopClosure& closure) {
  model::LoopResult result;
  result.utime = last_utime_.value_or(0);
  result.map_id = closure.map_id;
  result.closure_id = closure.id;
  if (closure.map_id != current_.map().landmarks.map_id()) {
    result.reason = "it is of another map than the one in use";
    return result;
  }
  if (parameters_.localisation_only) {
    result.reason = "localisation only: the map stays as it is";
    return result;
  }

  Closures::Decision decision = current_.take(closure);
  result.status = decision.status;
  result.reason = std::move(decision.reason);
  return result;
}

/// For another map than the one in use nothing is localised.
void SmoothingMapper::take(const model::Existence& existence) {
  if (existence.map_id == current_.map().landmarks.map_id()) current_.take(existence);
}

std::string SmoothingMapper::save() const { return state::save(kFormat, *this); }

void SmoothingMapper::load(const std::string& state) {
  SmoothingMapper loaded(parameters_);
  try {
    state::load(state, kFormat, loaded);
  } catch (const std::out_of_range& error) {
    throw std::invalid_argument(std::string("mapper state: ") + error.what());
  }
  *this = std::move(loaded);
}

}  // namespace understory::geoslam_mapper::smoothing
