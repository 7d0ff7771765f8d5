#include "services/ekf/ekf.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "services/ekf/chi_squared.hpp"
#include "services/ekf/ground_marks.hpp"
#include "services/ekf/prediction.hpp"

namespace understory::ekf {
namespace {

/// Stamps of one instant may miss each other by rounding.
constexpr model::Utime kTolerance_us = 1000;
constexpr double kStartVariance = 1e-12;
/// Of a piece's sway: a vehicle may stand for hours, in which chance must not pass for motion.
constexpr double kStationaryProbability = 1.0 - 1e-6;
/// Standing that is doubted is believed after all when it is told for so long.
constexpr double kInsistence_s = 10.0;
/// Squared way of a piece, of its variance: so far nothing goes that stands.
constexpr double kMoves = 50.0;

ErrorForm error_form(const std::string& name) {
  if (name == "right_invariant") return ErrorForm::kRightInvariant;
  if (name == "first_estimate") return ErrorForm::kFirstEstimate;
  if (name == "plain") return ErrorForm::kPlain;
  throw std::invalid_argument("error_form: no form is named " + name);
}

double seconds(model::Utime duration) { return 1e-6 * static_cast<double>(duration); }
model::Utime microseconds(double duration_s) { return static_cast<model::Utime>(1e6 * duration_s); }

Sway sway(const EkfMotionParameters& motion) {
  return {motion.stationary_sigma_m, motion.stationary_sigma_rad};
}

bool is_usable(const model::Odometry& increment) {
  bool usable = increment.utime > increment.from_utime &&
                increment.from_T_to.coordinates().allFinite() && increment.covariance.allFinite() &&
                increment.covariance.diagonal().minCoeff() >= 0.0;
  if (increment.inertial) {
    const model::Preintegration& p = *increment.inertial;
    usable = usable && std::isfinite(p.yaw_rad) && p.velocity_mps.allFinite() &&
             p.position_m.allFinite() && p.covariance.allFinite() &&
             p.covariance.diagonal().minCoeff() >= 0.0 && p.bias_jacobian.allFinite() &&
             p.bias.allFinite() && p.level.covariance.allFinite() && p.level.memory.allFinite() &&
             p.level.added.allFinite() && std::isfinite(p.level.pitch_tangent);
  }
  return usable;
}

/// Of the vehicle's pose (right perturbation), whose heading is the state's less `pitch_tangent`
/// times the roll's error.
Eigen::Matrix3d pose_covariance(const FilterState& state, double pitch_tangent) {
  const Eigen::Matrix2d back = rotation_of(state.heading).transpose();
  Eigen::Matrix<double, 3, 4> pose_by_state = Eigen::Matrix<double, 3, 4>::Zero();
  pose_by_state.block<2, 1>(0, 0) = back * state.lever(state.position);
  pose_by_state.block<2, 2>(0, 1) = back;
  pose_by_state(2, 0) = 1.0;
  pose_by_state(2, 3) = -pitch_tangent;
  Eigen::Matrix4d covariance;
  covariance.topLeftCorner<3, 3>() = state.covariance_block<3, 3>(0, 0);
  covariance.topRightCorner<3, 1>() = state.covariance_block<3, 1>(0, kLevel);
  covariance.bottomLeftCorner<1, 3>() = covariance.topRightCorner<3, 1>().transpose();
  covariance(3, 3) = state.covariance(kLevel, kLevel);
  return pose_by_state * covariance * pose_by_state.transpose();
}

}  // namespace

Ekf::Ekf(const EkfParameters& parameters)
    : parameters_(parameters),
      state_(error_form(parameters.error_form), parameters.map.max_landmarks + kGroundMarks),
      room_(kVehicle + 2 * state_.max_landmarks()),
      joint_(state_.max_landmarks()),
      landmark_gate_(chi_squared_quantile(parameters.gate.landmark_probability, 2)),
      parked_gate_(chi_squared_quantile(kStationaryProbability, 2 * kGroundMarks)),
      creeping_gate_(chi_squared_quantile(kStationaryProbability, 3)),
      still_gate_(chi_squared_quantile(kStationaryProbability, 2)) {
  const int capacity = kVehicle + 2 * state_.max_landmarks();
  backup_ = Eigen::MatrixXd::Zero(capacity, capacity);
  set_gates_.push_back(0.0);
  for (int k = 1; k <= parameters.map.max_landmarks; ++k) {
    set_gates_.push_back(chi_squared_quantile(parameters.gate.set_probability, 2 * k));
  }
}

void Ekf::set_prior() {
  const EkfPriorParameters& prior = parameters_.prior;
  state_.clear_landmarks();
  aliases_.clear();
  level_covariance_.reset();
  pitch_tangent_ = 0.0;
  auto covariance = state_.covariance();
  covariance.setZero();
  covariance.diagonal().segment<2>(kVelocity).setConstant(prior.velocity_sigma_mps *
                                                          prior.velocity_sigma_mps);
  const double gyro = prior.gyro_bias_sigma * prior.gyro_bias_sigma;
  const double force = prior.accelerometer_bias_sigma * prior.accelerometer_bias_sigma;
  covariance.diagonal().segment<3>(kBias) << gyro, force, force;
}

/// Until it is found to stand, which takes half a second, a vehicle may move at any speed, and turn
/// as the gyro's bias likes. A map that began before that would be off by as much for ever.
bool Ekf::may_begin(const model::Odometry& increment) {
  if (!heard_ || increment.utime < *heard_) heard_ = increment.from_utime;
  if (!increment.inertial || increment.is_stationary) return true;
  if (increment.utime - *heard_ > microseconds(parameters_.prior.wait_s)) return true;
  const double spread = increment.covariance.topLeftCorner<2, 2>().trace();
  return increment.has_wheels && increment.from_T_to.translation().squaredNorm() > kMoves * spread;
}

void Ekf::start(model::Utime utime) {
  started_ = true;
  heard_.reset();
  utime_ = utime;
  set_prior();
  state_.set_pose_covariance(kStartVariance * Eigen::Matrix3d::Identity());
  last_sound_ = pose();
  pose_sequence_ = 0;
}

void Ekf::restart(model::Utime utime, const std::string& reason) {
  ++counters_.restarts;
  ++reset_counter_;
  counters_.last_reason = reason;
  refused_scans_ = 0;
  doubted_.reset();
  utime_ = utime;
  set_prior();
  const model::EkfPose& last = last_sound_;
  state_.anchor_m.setZero();
  state_.position = last.ekf_map_T_vehicle.translation();
  state_.heading = last.ekf_map_T_vehicle.theta();
  state_.velocity.setZero();
  state_.bias = last.bias;
  state_.level.setZero();
  state_.first_position = state_.position;
  state_.first_velocity = state_.velocity;
  const EkfRestartParameters& grow = parameters_.restart;
  const Eigen::Vector3d sigma(grow.sigma_m, grow.sigma_m, grow.sigma_rad);
  const Eigen::Matrix3d added = sigma.cwiseAbs2().asDiagonal();
  state_.set_pose_covariance(last.covariance + added);
  state_.follow_with_anchor();
}

EkfOutput Ekf::add(const model::Odometry& increment) {
  ++counters_.odometry;
  if (!is_usable(increment)) {
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry is not finite";
    return {};
  }
  if (!started_ && !may_begin(increment)) return {};
  if (!started_) start(increment.from_utime);
  const model::Utime newest = waiting_.empty() ? utime_ : waiting_.back().utime;
  if (increment.utime < newest - microseconds(parameters_.restart.clock_jump_s)) {
    waiting_.clear();
    last_scan_.reset();
    restart(increment.from_utime, "the clock jumped back");
  } else if (increment.from_utime < newest - kTolerance_us) {
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry is late or overlaps";
    return {};
  }
  waiting_.push_back(increment);
  const model::Utime overdue = increment.utime - microseconds(parameters_.max_scan_delay_s);
  if (waiting_.front().utime > overdue) return {};
  advance(overdue);
  used_ = refused_ = 0;
  EkfOutput output;
  output.pose = pose();
  output.level = level();
  if (waiting_.empty() ? increment.is_stationary : waiting_.front().is_stationary) {
    output.correction = outputs().correction;
  }
  return output;
}

/// Uses the odometry that ends by `utime`.
void Ekf::advance(model::Utime utime) {
  while (!waiting_.empty() && waiting_.front().utime <= utime + kTolerance_us) {
    use(waiting_.front());
    waiting_.pop_front();
  }
}

void Ekf::use(const model::Odometry& increment) {
  if (increment.utime <= utime_ + kTolerance_us) {
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry came after the scan at its end";
    return;
  }
  if (increment.from_utime < utime_ - kTolerance_us) {
    // The piece began before a scan that came without it: what is left of it is unknown.
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry overlaps a scan";
    bridge(increment.utime);
    return;
  }
  if (increment.from_utime > utime_ + kTolerance_us) bridge(increment.from_utime);
  const EkfMotionParameters& motion = parameters_.motion;
  const bool is_stationary = believes_stationary(increment);
  const bool has_marks = has_ground_marks(state_);
  if (is_stationary && !has_marks) add_ground_marks(state_, sway(motion));
  if (!is_stationary && has_marks) leave_place();
  predict(increment, is_stationary);
  if (is_stationary) {
    stand();
  } else if (motion.sideways_sigma_mps > 0.0) {
    measure_no_slide(state_, motion.sideways_sigma_mps, room_);
  }
  if (!is_stationary) distance_m_ += increment.from_T_to.translation().norm();
  utime_ = increment.utime;
  state_.follow_with_anchor();
  if (!state_.is_sound()) restart(utime_, "the state was not finite after a prediction");
}

void Ekf::predict(const model::Odometry& increment, bool is_stationary) {
  const EkfMotionParameters& motion = parameters_.motion;
  if (increment.inertial) {
    if (!level_covariance_) know_level(state_, increment.inertial->level);
    level_covariance_ = increment.inertial->level.covariance;
    pitch_tangent_ = increment.inertial->level.pitch_tangent;
  }
  if (!increment.inertial) {
    const geometry::SE2WithCovariance moved{increment.from_T_to, increment.covariance};
    const double duration = seconds(increment.utime - increment.from_utime);
    ekf::predict(state_, transition_by(state_, moved, duration, motion), motion, room_);
  } else if (increment.has_wheels && !is_stationary) {
    const Eigen::Matrix2d turn = increment.from_T_to.rotation();
    const MeasuredMotion measured{
        increment.from_T_to.translation(),
        turn * increment.covariance.topLeftCorner<2, 2>() * turn.transpose()};
    ekf::predict(state_, *increment.inertial, measured, motion, room_);
  } else {
    ekf::predict(state_, transition_by(state_, *increment.inertial), motion, room_);
  }
}

/// Standing is told by quiet samples alone, where there are no wheels: a smooth road is quiet too.
/// So it is not believed against the filter's own velocity, nor, once found wrong, before it is
/// said to move; but after a while in which no landmark spoke for moving, the filter must be wrong.
bool Ekf::believes_stationary(const model::Odometry& increment) {
  if (!increment.is_stationary) doubted_.reset();
  if (!increment.is_stationary) return false;
  if (doubted_) {
    if (increment.utime - *doubted_ < microseconds(kInsistence_s)) return false;
    doubted_.reset();
    const double unknown = parameters_.prior.velocity_sigma_mps;
    state_.covariance().diagonal().segment<2>(kVelocity).array() += unknown * unknown;
    return true;
  }
  const double sigma = parameters_.motion.stationary_sigma_mps;
  Eigen::Matrix2d spread = state_.velocity_covariance().topLeftCorner<2, 2>();
  spread.diagonal().array() += sigma * sigma;
  const Eigen::Vector2d velocity = rotation_of(state_.heading).transpose() * state_.velocity;
  if (velocity.dot(spread.inverse() * velocity) <= still_gate_) return true;
  doubt_stationary();
  return false;
}

void Ekf::doubt_stationary() {
  ++counters_.crept;
  doubted_ = utime_;
  leave_place();
}

/// While it stood, landmarks were where they seemed to be from there; from elsewhere they will seem
/// to be somewhere else.
void Ekf::leave_place() {
  remove_ground_marks(state_);
  for (std::size_t i = 0; i < state_.landmarks().size(); ++i) {
    const MapLandmark& landmark = state_.landmarks()[i];
    if (landmark.seen_at_m < distance_m_) continue;
    state_.loosen_landmark(i, parameters_.observation.correlated_share * landmark.seen_variance_m2);
  }
}

/// The vehicle is where it was parked, and its velocity is that of its sway.
void Ekf::stand() {
  const EkfMotionParameters& motion = parameters_.motion;
  measure_stationary(state_, motion.stationary_sigma_mps, room_);
  if (measure_ground_marks(state_, sway(motion), parked_gate_, joint_, room_)) return;
  // A door was slammed, say.
  remove_ground_marks(state_);
  add_ground_marks(state_, sway(motion));
}

/// Nothing tells the motion until `utime`.
void Ekf::bridge(model::Utime utime) {
  ++counters_.gaps;
  remove_ground_marks(state_);  // It may have been driven on and parked again.
  const double duration = seconds(utime - utime_);
  if (duration > parameters_.restart.max_gap_s) return restart(utime, "too long a gap");
  distance_m_ += state_.velocity.norm() * duration;
  ekf::predict(state_, transition_over_gap(state_, duration, parameters_.motion),
               parameters_.motion, room_);
  utime_ = utime;
}

/// The state's heading is that of the frame that sweeps and odometry are levelled to. A wrong roll
/// turns it by as much times the pitch's tangent: up and down with every slope, not the vehicle.
/// A scale that sightings have in common makes the whole map, with the vehicle in it, larger or
/// smaller about its origin. No sighting tells that, so the state does without it.
model::EkfPose Ekf::pose() {
  model::EkfPose out;
  out.utime = utime_;
  out.sequence = pose_sequence_++;
  const geometry::SE2 pose = state_.pose();
  const double turned = pitch_tangent_ * state_.level.x();
  out.ekf_map_T_vehicle =
      geometry::SE2(pose.x(), pose.y(), geometry::wrap_angle(pose.theta() - turned));
  out.covariance = pose_covariance(state_, pitch_tangent_);
  const Eigen::Matrix<double, 5, 5> motion = state_.velocity_covariance();
  out.velocity_mps = rotation_of(state_.heading).transpose() * state_.velocity;
  out.velocity_covariance = motion.topLeftCorner<2, 2>();
  out.bias = state_.bias;
  out.bias_covariance = motion.bottomRightCorner<3, 3>();
  out.landmarks_used = used_;
  out.landmarks_refused = refused_;
  out.reset_counter = reset_counter_;
  last_sound_ = out;
  const Eigen::Vector2d off =
      out.ekf_map_T_vehicle.inverse().translation() * parameters_.observation.scale_sigma;
  out.covariance.topLeftCorner<2, 2>() += off * off.transpose();
  return out;
}

/// Of the latest pose.
std::optional<model::EkfLevel> Ekf::level() const {
  if (!level_covariance_) return std::nullopt;
  return model::EkfLevel{utime_, last_sound_.sequence, state_.level,
                         state_.covariance_block<2, 2>(kLevel, kLevel), *level_covariance_};
}

EkfOutput Ekf::outputs() {
  EkfOutput out;
  out.pose = pose();
  out.level = level();
  model::EkfMap& map = out.map.emplace();
  map.utime = utime_;
  map.sequence = map_sequence_++;
  const auto& landmarks = state_.landmarks();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const MapLandmark& landmark = landmarks[i];
    if (landmark.is_ground_mark()) continue;
    const Eigen::Vector2d position = landmark.position + state_.anchor_m;
    const Eigen::Vector2d off = position * parameters_.observation.scale_sigma;
    map.landmarks.push_back({landmark.id, position,
                             state_.landmark_covariance(i) + off * off.transpose(),
                             landmark.radius_m, landmark.kind, landmark.observation_count});
  }
  std::sort(map.landmarks.begin(), map.landmarks.end(),
            [](const model::EkfLandmark& a, const model::EkfLandmark& b) {
              return a.track_id < b.track_id;
            });
  model::VelocityCorrection& correction = out.correction.emplace();
  correction.utime = utime_;
  correction.sequence = out.pose->sequence;
  correction.velocity_mps = out.pose->velocity_mps;
  correction.bias = state_.bias;
  correction.covariance = state_.velocity_covariance();
  return out;
}

}  // namespace understory::ekf
