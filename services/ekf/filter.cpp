#include "services/ekf/filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/state/archive.hpp"
#include "services/ekf/gap_alignment.hpp"
#include "services/ekf/prediction.hpp"
#include "services/ekf/rejoin.hpp"
#include "services/ekf/state_covariances.hpp"

namespace understory::ekf {
namespace {

constexpr state::Format kFormat{"ekf", 9};
/// Variance of the first pose, which defines the map's origin; above zero for the factorisations.
constexpr double kStartVariance = 1e-12;
/// Searches for lost landmarks per scan.
constexpr int kMaxRejoinRounds = 4;
/// Longest time of creeping before its detection [s].
constexpr double kUnnoticed_s = 0.1;

ErrorForm error_form(const std::string& name) {
  if (name == "right_invariant") return ErrorForm::kRightInvariant;
  if (name == "first_estimate") return ErrorForm::kFirstEstimate;
  if (name == "plain") return ErrorForm::kPlain;
  throw std::invalid_argument("error_form: " + name +
                              " is not one of right_invariant, first_estimate, plain");
}

/// After a gap with a larger uncertainty of the heading the vehicle is localised in the map anew:
/// linear updates would be wrong.
constexpr double kAdrift_rad = 0.15;
/// Fewest observations, and landmarks, for localisation.
constexpr std::size_t kFewShowPlace = 3;
/// Search radius around the prediction.
constexpr double kPlaceSigmas = 3.0;
constexpr double kPlaceSlack_m = 5.0;

/// Largest sigma of the position after hours; a larger number only costs digits of the covariance
/// [m].
constexpr double kAnywhere_m = 1000.0;

/// Adds the possible motion in `away_s` at this speed to `sigma` (x, y, heading [m, m, rad]).
void add_time_away(double away_s, double speed_mps, const EkfMotionParameters& motion,
                   Eigen::Vector3d& sigma) {
  const double spread = motion.gap_acceleration * std::sqrt(away_s * away_s * away_s / 3.0);
  const double moved = std::min(std::hypot(speed_mps * away_s, spread), kAnywhere_m);
  sigma.head<2>() = (sigma.head<2>().array().square() + moved * moved).sqrt();
  sigma.z() = std::min(std::hypot(sigma.z(), motion.gap_yaw_rate * away_s), kAnyHeading_rad);
}

/// Places the vehicle at `last`, stationary; `sigma`: added to its uncertainty.
void place_at(const SoundPose& last, const Eigen::Vector3d& sigma, FilterState& state) {
  state.anchor_m.setZero();
  state.position = last.ekf_map_T_vehicle.translation();
  state.heading = last.ekf_map_T_vehicle.theta();
  state.velocity.setZero();
  state.bias = last.bias;
  state.level.setZero();
  state.first_position = state.position;
  state.first_velocity = state.velocity;

  const Eigen::Matrix3d added = sigma.cwiseAbs2().asDiagonal();
  set_pose_covariance(state, last.covariance + added);
  state.follow_with_anchor();
}

}  // namespace

Filter::Filter(const EkfParameters& parameters)
    : parameters_(parameters),
      gates_(parameters.gate, parameters.map.max_landmarks),
      scratch_(parameters.map.max_landmarks + kGroundMarks),
      state_(error_form(parameters.error_form), parameters.map.max_landmarks + kGroundMarks),
      timeline_(parameters.prior.wait_s, parameters.restart.clock_jump_s),
      queue_(parameters.max_scan_delay_s, parameters.restart.clock_jump_s),
      motion_(parameters.motion),
      stationary_(parameters, gates_.stationary),
      map_(parameters.map, parameters.observation),
      report_(parameters.observation) {}

void Filter::add(const model::Odometry& increment) {
  ++counters_.odometry;
  if (!is_usable(increment)) {
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry is not finite";
    return;
  }

  // The map begins when the vehicle's motion is known.
  if (!timeline_.has_begun()) {
    if (!timeline_.may_begin(increment)) return;
    begin(increment.from_utime);
  }

  if (!accept(increment)) return;
  report_.add(increment);
  queue_.push(increment);
}

EkfOutput Filter::go_ahead() {
  const bool is_stationary_last = queue_.newest().is_stationary;
  advance(*queue_.overdue());
  EkfOutput output = report_.pose(state_, motion_, timeline_.now(), {});
  if (queue_.next() ? queue_.next()->is_stationary : is_stationary_last)
    output.correction = report_.all(state_, motion_, timeline_.now(), {}).correction;
  return output;
}

void Filter::add(const model::RawPose& pose) { reckoned_.add(pose); }

bool Filter::takes_scan_at(model::Utime utime) const {
  if (!timeline_.has_begun()) return !timeline_.is_waiting();
  return timeline_.order_of_scan(utime) != StampOrder::kLate;
}

EkfOutput Filter::add(const model::TrackedScan& scan) {
  ++counters_.scans;
  if (timeline_.is_waiting()) return {};  // Its landmarks will be observed again.
  if (!timeline_.has_begun()) begin(scan.utime);
  if (!accept_scan(scan.utime)) return {};

  // Predict to the scan's stamp.
  advance(scan.utime);
  if (timeline_.is_behind(scan.utime)) bridge(scan.utime);

  // Common motion of the landmarks shows that the vehicle is not stationary.
  ScanUpdate update = read(scan);
  if (doubt_.is_adrift && !find_place(scan, update))
    return report_.all(state_, motion_, timeline_.now(), update);
  check_stationary(update);

  // Updates by known landmarks, then by lost ones, with the improved pose.
  update_known(scan, update);
  rejoin_lost(scan, update);

  // Adds and removes landmarks; restarts a lost filter.
  maintain_map(scan, update);

  stationary_.confirm_motion(timeline_.now(), update.used);
  counters_.landmarks_used += update.used;
  counters_.landmarks_refused += update.refused;
  EkfOutput output = report_.all(state_, motion_, timeline_.now(), update);
  output.scan = {static_cast<std::uint32_t>(update.observations.size()), update.used, update.nis,
                 update.nis_degrees};
  return output;
}

void Filter::begin(model::Utime utime) {
  timeline_.begin(utime);
  set_prior(state_, parameters_.prior);
  map_.clear();
  motion_.forget_level();
  set_pose_covariance(state_, kStartVariance * Eigen::Matrix3d::Identity());
  report_.begin(state_, motion_);
}

/// Restarts at the last valid pose, without a map. `away_s`: time without information.
void Filter::restart(model::Utime utime, const std::string& reason, double away_s) {
  const double speed_mps = is_sound(state_) ? state_.velocity.norm() : 0.0;
  count_restart(reason);
  doubt_ = {};
  stationary_.reset();
  timeline_.move_to(utime);
  set_prior(state_, parameters_.prior);
  map_.clear();
  motion_.forget_level();

  const EkfRestartParameters& grow = parameters_.restart;
  Eigen::Vector3d sigma(grow.sigma_m, grow.sigma_m, grow.sigma_rad);
  add_time_away(away_s, speed_mps, parameters_.motion, sigma);
  place_at(report_.last_sound(), sigma, state_);
}

/// False for a late increment; a clock that jumped back restarts the filter.
bool Filter::accept(const model::Odometry& increment) {
  switch (queue_.order_of(increment, timeline_.now())) {
    case StampOrder::kInOrder:
      return true;
    case StampOrder::kClockJumpedBack:
      ++counters_.clock_jumps;
      queue_.clear();
      timeline_.forget_scans();
      restart(increment.from_utime, "the clock jumped back");
      return true;
    case StampOrder::kLate:
      break;
  }
  ++counters_.odometry_refused;
  counters_.last_reason = "odometry is late or overlaps";
  return false;
}

/// The same for a scan.
bool Filter::accept_scan(model::Utime utime) {
  switch (timeline_.order_of_scan(utime)) {
    case StampOrder::kInOrder:
      break;
    case StampOrder::kClockJumpedBack:
      ++counters_.clock_jumps;
      queue_.clear();
      restart(utime, "the clock jumped back");
      break;
    case StampOrder::kLate:
      ++counters_.scans_refused;
      counters_.last_reason = "scan is late or came twice";
      return false;
  }
  timeline_.set_last_scan(utime);
  return true;
}

/// Uses the odometry that ends by `utime`.
void Filter::advance(model::Utime utime) {
  while (const auto increment = queue_.take_ended_by(utime)) use(*increment);
}

void Filter::use(const model::Odometry& increment) {
  // Its interval must continue the filter's time.
  switch (timeline_.interval_of(increment)) {
    case Interval::kPast:
      ++counters_.odometry_refused;
      counters_.last_reason = "odometry came after the scan at its end";
      return;
    case Interval::kOverlaps:  // The part after the scan is unknown.
      ++counters_.odometry_refused;
      counters_.last_reason = "odometry overlaps a scan";
      bridge(increment.utime);
      return;
    case Interval::kAfterGap:
      bridge(increment.from_utime);
      break;
    case Interval::kFollows:
      break;
  }

  // Is the vehicle stationary?
  const bool was_doubted = stationary_.is_doubted();
  const bool is_stationary =
      stationary_.is_stationary(increment, timeline_.now(), motion_.distance_m(), state_);
  if (!was_doubted && stationary_.is_doubted()) ++counters_.crept;

  // Predicts, and applies the measurements of a stationary vehicle.
  motion_.predict(increment, is_stationary, state_, scratch_.low_rank);
  if (is_stationary) stationary_.hold(state_, scratch_);
  timeline_.move_to(increment.utime);
  state_.follow_with_anchor();

  if (!is_sound(state_)) {
    restart(timeline_.now(), "the state was not finite after a prediction");
  }
}

/// Predicts to `utime` without odometry.
void Filter::bridge(model::Utime utime) {
  ++counters_.gaps;
  remove_ground_marks(state_);  // The vehicle may have moved and stopped elsewhere.
  const double duration = seconds(utime - timeline_.now());
  const std::string reason = fmt::format("nothing came for {:.2f} s", duration);

  // Dead reckoning may have continued.
  if (const auto motion = reckoned_.between(timeline_.now(), utime)) {
    motion_.bridge(*motion, duration, state_, scratch_.low_rank);
    timeline_.move_to(utime);
    state_.follow_with_anchor();
    return announce_gap(duration, reason);
  }

  if (duration > parameters_.restart.max_gap_s) return restart(utime, reason, duration);
  motion_.bridge(duration, state_, scratch_.low_rank);
  timeline_.move_to(utime);

  const bool has_map = state_.landmarks().size() >= kFewShowPlace;
  if (has_map && parameters_.motion.gap_yaw_rate * duration > kAdrift_rad) doubt_.is_adrift = true;
  announce_gap(duration, reason);
}

void Filter::announce_gap(double duration_s, const std::string& reason) {
  if (duration_s <= parameters_.restart.announced_gap_s) return;
  count_restart(reason);
}

void Filter::count_restart(const std::string& reason) {
  ++counters_.restarts;
  counters_.last_reason = reason;
  report_.count_restart();
}

ScanUpdate Filter::read(const model::TrackedScan& scan) {
  map_.begin_scan();
  ScanUpdate update = read_scan(scan, motion_.level_covariance());
  counters_.landmarks_unusable += scan.landmarks.size() - update.observations.size();
  steady_heights(state_, map_.known(state_, update), update);
  return update;
}

/// After a gap: localises the vehicle by the scan, and updates by the landmarks used for it. False
/// if it cannot be localised and linear updates would be wrong.
bool Filter::find_place(const model::TrackedScan& scan, ScanUpdate& update) {
  if (update.observations.size() < kFewShowPlace) return false;
  const Eigen::Matrix2d spread = state_.covariance_block<2, 2>(kPosition, kPosition);
  const double radius_m = kPlaceSigmas * std::sqrt(spread.trace()) + kPlaceSlack_m;
  const std::vector<Pairing> known = map_.known(state_, update);
  const auto found = align_after_gap(state_, update, known, radius_m);
  if (!found) {
    if (++doubt_.adrift_scans >= parameters_.restart.after_refused_scans)
      restart(timeline_.now(), "its place was not found after a gap");
    return false;
  }

  move_vehicle(state_, found->anchor_T_vehicle);
  std::vector<Pairing> pairings = found->pairings;
  update.refused +=
      update_compatible(state_, update.observations, pairings, gates_.set, scratch_).removed;
  update.used += static_cast<std::uint32_t>(pairings.size());
  for (const Pairing& pairing : pairings) {
    const auto is_same = [&pairing](const Pairing& one) {
      return one.observation == pairing.observation && one.landmark == pairing.landmark;
    };
    if (std::ranges::none_of(known, is_same)) ++counters_.rejoined;
    map_.rejoin(scan, pairing, state_, update);
  }
  doubt_.is_adrift = false;
  doubt_.adrift_scans = 0;
  return true;
}

void Filter::check_stationary(const ScanUpdate& update) {
  if (!stationary_.is_creeping(state_, update.observations, map_.known(state_, update),
                               gates_.landmark)) {
    return;
  }
  ++counters_.crept;
  stationary_.doubt(timeline_.now(), motion_.distance_m(), state_);
  motion_.loosen(kUnnoticed_s, state_, scratch_.low_rank);
}

/// Landmarks with continuing tracks: each through its own gate, then all through the gate of the
/// set.
void Filter::update_known(const model::TrackedScan& scan, ScanUpdate& update) {
  std::vector<Pairing> pairings;
  std::vector<bool> is_taken(state_.landmarks().size(), false);
  for (const Pairing& pairing : map_.known(state_, update))
    if (update.is_settled[pairing.observation]) is_taken[pairing.landmark] = true;
  for (const Pairing& pairing : map_.known(state_, update)) {
    if (update.is_settled[pairing.observation])
      continue;  // Already used for localisation after a gap.
    update.is_settled[pairing.observation] = true;
    const Observation& observation = update.observations[pairing.observation];
    if (is_taken[pairing.landmark] ||
        squared_distance(state_, pairing.landmark, observation) > gates_.landmark) {
      ++update.refused;
      ++state_.landmark(pairing.landmark).refused;
      continue;
    }
    is_taken[pairing.landmark] = true;
    pairings.push_back(pairing);
  }

  for (const Pairing& pairing : pairings) {
    map_.weaken(pairing, motion_.distance_m(), state_, update);
  }
  const CompatibleUpdate updated =
      update_compatible(state_, update.observations, pairings, gates_.set, scratch_);
  update.refused += updated.removed;
  update.used += static_cast<std::uint32_t>(pairings.size());
  update.nis = updated.distance + gates_.landmark * update.refused;
  update.nis_degrees = 2 * static_cast<int>(update.used + update.refused);
  for (const Pairing& pairing : pairings) map_.count_observed(scan, pairing, state_, update);
}

/// Pairs unknown tracks with landmarks whose track was lost. Each round improves the pose, so the
/// next one finds more.
void Filter::rejoin_lost(const model::TrackedScan& scan, ScanUpdate& update) {
  RejoinRules rules{parameters_.gate, gates_, parameters_.map.min_separation_m,
                    parameters_.gate.rejoin_max_nodes};
  for (int round = 0; round < kMaxRejoinRounds; ++round) {
    auto proposal = find_rejoining(state_, scan, update, map_.scan_number(), rules);
    if (!proposal) return;
    rules.max_nodes -= proposal->nodes;

    std::vector<Pairing>& pairings = proposal->pairings;
    update.refused +=
        update_compatible(state_, proposal->observations, pairings, gates_.set, scratch_).removed;
    update.used += static_cast<std::uint32_t>(pairings.size());
    for (const Pairing& pairing : pairings) map_.rejoin(scan, pairing, state_, update);
    counters_.rejoined += pairings.size();
    if (pairings.empty()) return;
  }
}

void Filter::maintain_map(const model::TrackedScan& scan, const ScanUpdate& update) {
  if (!is_sound(state_)) {
    restart(timeline_.now(), "the state was not finite after an update");
    return;
  }
  map_.add_new(scan, motion_.distance_m(), update, state_, counters_);
  map_.count_missed(scan.field_of_view, state_);
  map_.remove_stale(scan.field_of_view, state_, counters_);

  // Many successive scans contradict the map: the error is larger than the covariance states.
  doubt_.refused_scans = is_at_odds(update) ? doubt_.refused_scans + 1 : 0;
  if (doubt_.refused_scans >= parameters_.restart.after_refused_scans) {
    restart(timeline_.now(), "most landmarks were refused, scan after scan");
  }
}

std::string Filter::save() const {
  return state::save(kFormat, timeline_, queue_, motion_, reckoned_, stationary_, map_, report_,
                     doubt_, state_);
}

void Filter::load(const std::string& state) {
  Filter loaded(parameters_);
  state::load(state, kFormat, loaded.timeline_, loaded.queue_, loaded.motion_, loaded.reckoned_,
              loaded.stationary_, loaded.map_, loaded.report_, loaded.doubt_, loaded.state_);
  loaded.counters_ = counters_;  // Of this process, not of the one that saved.
  *this = std::move(loaded);
}

}  // namespace understory::ekf
