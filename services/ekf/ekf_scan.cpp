// The filter and one scan's landmarks.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/model/level.hpp"
#include "services/ekf/ekf.hpp"
#include "services/ekf/ground_marks.hpp"
#include "services/ekf/prediction.hpp"

namespace understory::ekf {
namespace {

/// That tell a vehicle's motion.
constexpr std::uint32_t kFewLandmarks = 3;
/// Motion that nothing told, where creeping is found [s].
constexpr double kUnnoticed_s = 0.1;
/// Of the height's variance that the level makes: less was made without it.
constexpr double kLevelled = 0.5;
/// Of what a scan says of the vehicle's rise: it has noise too, and a slope is gentle.
constexpr double kRiseGain = 0.2;

bool is_usable(const model::Detection& detection) {
  if (!detection.position_m.allFinite() || !detection.covariance_m2.allFinite()) return false;
  const Eigen::Matrix2d covariance = detection.covariance_m2.topLeftCorner<2, 2>();
  return covariance.llt().info() == Eigen::Success;
}

}  // namespace

EkfOutput Ekf::add(const model::TrackedScan& scan) {
  ++counters_.scans;
  const auto jump = static_cast<model::Utime>(1e6 * parameters_.restart.clock_jump_s);
  if (heard_) return {};  // Its landmarks will be seen again.
  if (!started_) start(scan.utime);
  if (last_scan_ && scan.utime < *last_scan_ - jump) {
    waiting_.clear();
    restart(scan.utime, "the clock jumped back");
  } else if ((last_scan_ && scan.utime <= *last_scan_) || scan.utime < utime_ - 1000) {
    ++counters_.scans_refused;
    counters_.last_reason = "scan is late or came twice";
    return {};
  }
  last_scan_ = scan.utime;
  advance(scan.utime);
  if (scan.utime > utime_ + 1000) bridge(scan.utime);
  ++scan_count_;
  used_ = refused_ = 0;
  read(scan);
  check_stationary();
  update_known();
  for (const Pairing& pairing : pairings_) see(scan, pairing);
  rejoin_lost(scan);
  if (!state_.is_sound()) {
    restart(utime_, "the state was not finite after an update");
  } else {
    add_new(scan);
    count_missed(scan.field_of_view);
    remove_distant(scan.field_of_view);
    check_lost();
  }
  if (doubted_ && used_ >= kFewLandmarks) doubted_ = utime_;
  counters_.landmarks_used += used_;
  counters_.landmarks_refused += refused_;
  return outputs();
}

void Ekf::read(const model::TrackedScan& scan) {
  observations_.clear();
  source_.clear();
  for (std::uint32_t i = 0; i < scan.landmarks.size(); ++i) {
    const model::Detection& seen = scan.landmarks[i].observed;
    if (scan.landmarks[i].track_id == 0 || !is_usable(seen)) {
      ++counters_.landmarks_unusable;
      continue;
    }
    observations_.push_back(observation(seen));
    source_.push_back(i);
  }
  settled_.assign(observations_.size(), false);
  tracks_.clear();
  for (const std::uint32_t i : source_) tracks_.push_back(scan.landmarks[i].track_id);
  steady_heights();
}

/// The level displaces a sighting by its height. Where a trunk leans, the height's own noise
/// displaces it too, and would pass for a level that is off by the lean. So a landmark keeps the
/// height that it was first seen at, but for what the vehicle rises and sinks among them all.
void Ekf::steady_heights() {
  std::vector<Pairing> levelled;
  std::vector<double> changes;
  for (std::uint32_t k = 0; k < observations_.size(); ++k) {
    const auto landmark = landmark_of(tracks_[k]);
    if (!landmark || observations_[k].height_m == 0.0) continue;
    if (state_.landmarks()[*landmark].height_m == 0.0) continue;
    levelled.push_back({k, *landmark});
    changes.push_back(observations_[k].height_m - state_.landmarks()[*landmark].height_m);
  }
  double rise = 0.0;
  if (!changes.empty() && !has_ground_marks(state_)) {
    const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
    std::nth_element(changes.begin(), middle, changes.end());
    rise = kRiseGain * *middle;
  }
  for (std::size_t i = 0; i < state_.landmarks().size(); ++i) {
    MapLandmark& landmark = state_.landmark(i);
    if (landmark.height_m != 0.0) landmark.height_m += rise;
  }
  for (const Pairing& pairing : levelled) {
    observations_[pairing.observation].height_m = state_.landmarks()[pairing.landmark].height_m;
  }
}

/// A levelled detection's covariance has the level's error in it, which is not its own: the state
/// has it. (One whose height is surer than that was not levelled.)
Observation Ekf::observation(const model::Detection& seen) const {
  const Eigen::Matrix2d whole = seen.covariance_m2.topLeftCorner<2, 2>();
  Observation result{seen.position_m.head<2>(), whole};
  if (!level_covariance_) return result;
  const Eigen::Vector2d up(seen.position_m.y(), -seen.position_m.x());
  if (seen.covariance_m2(2, 2) < kLevelled * up.dot(*level_covariance_ * up)) return result;
  result.height_m = seen.position_m.z();
  const Eigen::Matrix2d arm = result.height_m * level_displacement();
  result.covariance_m2 = model::without_level(whole, arm, *level_covariance_);
  return result;
}

std::optional<std::uint32_t> Ekf::landmark_of(model::TrackId track) const {
  const auto alias =
      std::lower_bound(aliases_.begin(), aliases_.end(), track,
                       [](const Alias& a, model::TrackId key) { return a.track < key; });
  if (alias == aliases_.end() || alias->track != track) return std::nullopt;
  const auto& landmarks = state_.landmarks();
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].id == alias->landmark) return i;
  }
  return std::nullopt;
}

/// All landmarks displaced alike, or most of them at odds with the map: the vehicle creeps, though
/// it is said to stand.
void Ekf::check_stationary() {
  if (!has_ground_marks(state_)) return;
  std::size_t known = 0;
  std::size_t near = 0;
  std::vector<Pairing> pairings;
  for (std::uint32_t k = 0; k < observations_.size(); ++k) {
    const auto landmark = landmark_of(tracks_[k]);
    if (!landmark) continue;
    ++known;
    if (squared_distance(state_, *landmark, observations_[k]) > landmark_gate_) continue;
    ++near;
    if (pairings.size() < kMaxRows / 2) pairings.push_back({k, *landmark});
  }
  const bool at_odds = known >= 4 && 2 * near < known;
  if (!at_odds &&
      (pairings.size() < 2 || common_motion(state_, observations_, pairings) <= creeping_gate_)) {
    return;
  }
  doubt_stationary();
  ekf::predict(state_, transition_over_gap(state_, kUnnoticed_s, parameters_.motion),
               parameters_.motion, room_);
}

/// Landmarks whose track goes on: each through its own gate, then all through the set's.
void Ekf::update_known() {
  pairings_.clear();
  std::vector<bool> taken(state_.landmarks().size(), false);
  for (std::uint32_t k = 0; k < observations_.size(); ++k) {
    const auto landmark = landmark_of(tracks_[k]);
    if (!landmark) continue;
    settled_[k] = true;
    const bool refused =
        taken[*landmark] || squared_distance(state_, *landmark, observations_[k]) > landmark_gate_;
    if (refused) {
      ++refused_;
      ++state_.landmark(*landmark).refused;
      continue;
    }
    taken[*landmark] = true;
    pairings_.push_back({k, *landmark});
  }
  for (const Pairing& pairing : pairings_) weaken(pairing);
  update_checked(pairings_, observations_);
}

/// Updates by as many pairings as are compatible together: the worst go until the rest are.
void Ekf::update_checked(std::vector<Pairing>& pairings,
                         std::span<const Observation> observations) {
  if (pairings.empty()) return;
  const int n = state_.size();
  backup_.topLeftCorner(n, n) = state_.covariance();
  const auto worse = [&](const Pairing& a, const Pairing& b) {
    return squared_distance(state_, a.landmark, observations[a.observation]) <
           squared_distance(state_, b.landmark, observations[b.observation]);
  };
  while (!pairings.empty()) {
    const double distance = joint_.apply(state_, observations, pairings, room_);
    if (distance >= 0.0 && distance <= set_gates_[pairings.size()]) {
      joint_.finish(state_, room_);
      break;
    }
    state_.covariance() = backup_.topLeftCorner(n, n);
    // A twentieth at a time, so that a scan at odds with the map ends soon.
    const std::size_t drop = 1 + pairings.size() / 20;
    for (std::size_t k = 0; k < drop && !pairings.empty(); ++k) {
      const auto worst = std::max_element(pairings.begin(), pairings.end(), worse);
      ++state_.landmark(worst->landmark).refused;
      ++refused_;
      pairings.erase(worst);
    }
  }
  used_ += static_cast<std::uint32_t>(pairings.size());
}

/// A part of the error is the same as in the sightings before. It is counted as white noise of the
/// power that it has over many scans: with a correlation r from scan to scan, (1 + r) / (1 - r)
/// times its variance. While the vehicle stands, the landmark is where it seems to be
/// (leave_place()).
void Ekf::weaken(const Pairing& pairing) {
  MapLandmark& landmark = state_.landmark(pairing.landmark);
  Observation& seen = observations_[pairing.observation];
  const double moved = distance_m_ - landmark.seen_at_m;
  landmark.seen_at_m = distance_m_;
  landmark.seen_variance_m2 = 0.5 * seen.covariance_m2.trace();
  if (has_ground_marks(state_)) {
    landmark.views = 1.0;
    return;
  }
  landmark.views = 1.0 + landmark.views * std::exp(-moved / parameters_.observation.correlation_m);
  seen.covariance_m2 *=
      1.0 + 2.0 * parameters_.observation.correlated_share * (landmark.views - 1.0);
}

void Ekf::see(const model::TrackedScan& scan, const Pairing& pairing) {
  settled_[pairing.observation] = true;
  MapLandmark& landmark = state_.landmark(pairing.landmark);
  const model::Detection& seen = scan.landmarks[source_[pairing.observation]].observed;
  ++landmark.observation_count;
  landmark.missed = 0;
  landmark.refused = 0;
  landmark.last_scan = scan_count_;
  if (std::isfinite(seen.radius_m)) {
    landmark.radius_m += (seen.radius_m - landmark.radius_m) / landmark.observation_count;
  }
}

bool Ekf::near_old(const Eigen::Vector2d& position) const {
  const double limit = parameters_.map.min_separation_m * parameters_.map.min_separation_m;
  const auto& landmarks = state_.landmarks();
  return std::any_of(landmarks.begin(), landmarks.end(), [&](const MapLandmark& landmark) {
    return !landmark.is_ground_mark() && (landmark.position - position).squaredNorm() < limit;
  });
}

void Ekf::add_new(const model::TrackedScan& scan) {
  const Eigen::Matrix2d rotation = rotation_of(state_.heading);
  for (std::size_t k = 0; k < observations_.size(); ++k) {
    if (settled_[k] || landmark_of(tracks_[k])) continue;
    const Eigen::Vector2d displaced =
        observations_[k].height_m * level_displacement() * state_.level;
    const Eigen::Vector2d position =
        state_.position + rotation * (observations_[k].position_m - displaced);
    if (near_old(position) || !make_room(scan.field_of_view)) {
      ++counters_.landmarks_too_near;
      continue;
    }
    const model::Detection& seen = scan.landmarks[source_[k]].observed;
    MapLandmark landmark;
    landmark.id = tracks_[k];
    landmark.radius_m = std::isfinite(seen.radius_m) ? seen.radius_m : 0.0;
    landmark.kind = seen.kind;
    landmark.observation_count = 1;
    landmark.views = 1.0;
    landmark.seen_at_m = distance_m_;
    landmark.seen_variance_m2 = 0.5 * observations_[k].covariance_m2.trace();
    landmark.last_scan = scan_count_;
    landmark.height_m = observations_[k].height_m;
    state_.add_landmark(landmark, observations_[k].position_m, observations_[k].covariance_m2,
                        observations_[k].height_m);
    const auto at =
        std::lower_bound(aliases_.begin(), aliases_.end(), landmark.id,
                         [](const Alias& a, model::TrackId key) { return a.track < key; });
    if (at != aliases_.end() && at->track == landmark.id) {
      at->landmark = landmark.id;
    } else {
      aliases_.insert(at, {landmark.id, landmark.id});
    }
  }
}

/// True if a landmark may be added: a full state gives up the one that is out of sight for longest.
bool Ekf::make_room(const model::FieldOfView& view) {
  const auto& landmarks = state_.landmarks();
  const int marks = has_ground_marks(state_) ? kGroundMarks : 0;
  if (static_cast<int>(landmarks.size()) - marks < parameters_.map.max_landmarks) return true;
  std::optional<std::size_t> oldest;
  const Eigen::Matrix2d back = rotation_of(state_.heading).transpose();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].is_ground_mark()) continue;
    if (view.contains(back * (landmarks[i].position - state_.position))) continue;
    if (!oldest || landmarks[i].last_scan < landmarks[*oldest].last_scan) oldest = i;
  }
  if (oldest) remove(*oldest);
  return oldest.has_value();
}

void Ekf::count_missed(const model::FieldOfView& view) {
  const Eigen::Matrix2d back = rotation_of(state_.heading).transpose();
  for (std::size_t i = 0; i < state_.landmarks().size(); ++i) {
    MapLandmark& landmark = state_.landmark(i);
    if (landmark.is_ground_mark() || landmark.last_scan == scan_count_) continue;
    if (view.contains(back * (landmark.position - state_.position))) ++landmark.missed;
  }
}

void Ekf::remove_distant(const model::FieldOfView& view) {
  const double range = parameters_.map.keep_range_factor * view.max_range_m;
  for (std::size_t i = state_.landmarks().size(); i-- > 0;) {
    const MapLandmark& landmark = state_.landmarks()[i];
    if (landmark.is_ground_mark()) continue;
    const bool distant = (landmark.position - state_.position).norm() > range;
    const bool gone = landmark.missed > static_cast<std::uint32_t>(parameters_.map.max_missed);
    const bool wrong = landmark.refused >= static_cast<std::uint32_t>(parameters_.map.max_refused);
    if (distant || gone || wrong) remove(i);
  }
}

void Ekf::remove(std::size_t landmark) {
  const model::TrackId id = state_.landmarks()[landmark].id;
  state_.remove_landmark(landmark);
  std::erase_if(aliases_, [&](const Alias& alias) { return alias.landmark == id; });
  ++counters_.removed;
}

/// Scan after scan at odds with the map: the estimate is wrong by more than it says.
void Ekf::check_lost() {
  const bool at_odds = refused_ >= 4 && refused_ > 2 * used_;
  refused_scans_ = at_odds ? refused_scans_ + 1 : 0;
  if (refused_scans_ >= parameters_.restart.after_refused_scans) {
    restart(utime_, "most landmarks were refused, scan after scan");
  }
}

}  // namespace understory::ekf
