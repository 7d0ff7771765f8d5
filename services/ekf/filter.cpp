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
/// Variance of the first pose, by definition the map's origin; above zero for the factorisations.
constexpr double kStartVariance = 1e-12;
/// Searches for lost landmarks per scan.
constexpr int kMaxRejoinRounds = 4;
/// Time that creeping may have lasted before it was found [s].
constexpr double kUnnoticed_s = 0.1;

ErrorForm error_form(const std::string& name) {
  if (name == "right_invariant") return ErrorForm::kRightInvariant;
  if (name == "first_estimate") return ErrorForm::kFirstEstimate;
  if (name == "plain") return ErrorForm::kPlain;
  throw std::invalid_argument("error_form: " + name +
                              " is not one of right_invariant, first_estimate, plain");
}

/// After a gap in which the heading became less certain than this the place in the map is found
/// anew: linear updates are not true any more.
constexpr double kAdrift_rad = 0.15;
/// Observations, and landmarks, that show a place.
constexpr std::size_t kFewShowPlace = 3;
/// How far from the prediction the place is looked for.
constexpr double kPlaceSigmas = 3.0;
constexpr double kPlaceSlack_m = 5.0;

/// After hours a vehicle may be anywhere; a larger number only costs digits of the covariance [m].
constexpr double kAnywhere_m = 1000.0;

/// Adds to `sigma` (x, y, heading [m, m, rad]) what may have happened in `away_s` at this speed.
void add_time_away(double away_s, double speed_mps, const EkfMotionParameters& motion,
                   Eigen::Vector3d& sigma) {
  const double spread = motion.gap_acceleration * std::sqrt(away_s * away_s * away_s / 3.0);
  const double moved = std::min(std::hypot(speed_mps * away_s, spread), kAnywhere_m);
  sigma.head<2>() = (sigma.head<2>().array().square() + moved * moved).sqrt();
  sigma.z() = std::min(std::hypot(sigma.z(), motion.gap_yaw_rate * away_s), kAnyHeading_rad);
}

/// Puts the vehicle at `last`, stationary; `sigma`: what is added to its uncertainty.
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

  // The map begins where the vehicle's motion is known.
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

  // Landmarks that move together show a vehicle that is not stationary.
  ScanUpdate update = read(scan);
  if (doubt_.is_adrift && !find_place(scan, update))
    return report_.all(state_, motion_, timeline_.now(), update);
  check_stationary(update);

  // Update by known landmarks, then by lost ones, for which the pose is now better known.
  update_known(scan, update);
  rejoin_lost(scan, update);

  // New landmarks enter the map, others leave it; a filter that is lost starts again.
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

/// Goes on from the last sound pose, without a map. `away_s`: nothing is known of so long.
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

/// False where the increment is late; a clock that jumped back restarts the filter.
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

  // Predict, and measure what a stationary vehicle is known to do.
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

  // Dead reckoning may have gone on.
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

/// After a gap: moves the vehicle to where the scan shows it, and updates by what shows it. False
/// where it does not show, and linear updates would mislead.
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

/// Landmarks whose track continues: each through its own gate, then all through the gate of the
/// set.
void Filter::update_known(const model::TrackedScan& scan, ScanUpdate& update) {
  std::vector<Pairing> pairings;
  std::vector<bool> is_taken(state_.landmarks().size(), false);
  for (const Pairing& pairing : map_.known(state_, update))
    if (update.is_settled[pairing.observation]) is_taken[pairing.landmark] = true;
  for (const Pairing& pairing : map_.known(state_, update)) {
    if (update.is_settled[pairing.observation]) continue;  // It has shown the place after a gap.
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

/// Unknown tracks may be landmarks whose track was lost. Each round makes the pose more certain, so
/// that the next one finds more.
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

  // Scan after scan at odds with the map: the error is larger than the covariance states.
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
