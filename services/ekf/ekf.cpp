#include "services/ekf/ekf.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "services/ekf/chi_squared.hpp"
#include "services/ekf/ground_marks.hpp"
#include "services/ekf/prediction.hpp"

namespace understory {
namespace {

/// Stamps of one instant may miss each other by rounding.
constexpr Utime kTolerance_us = 1000;
constexpr double kStartVariance = 1e-12;
/// Of a piece's sway: a vehicle may stand for hours, in which chance must not pass for motion.
constexpr double kStandingProbability = 1.0 - 1e-6;
/// Standing that is doubted is believed after all when it is told for so long.
constexpr double kInsistence_s = 10.0;
/// Squared way of a piece, of its variance: so far nothing goes that stands.
constexpr double kMoves = 50.0;

ekf::ErrorForm error_form(const std::string& name) {
  if (name == "right_invariant") return ekf::ErrorForm::kRightInvariant;
  if (name == "first_estimate") return ekf::ErrorForm::kFirstEstimate;
  if (name == "plain") return ekf::ErrorForm::kPlain;
  throw std::invalid_argument("error_form: no form is named " + name);
}

double seconds(Utime duration) { return 1e-6 * static_cast<double>(duration); }
Utime microseconds(double duration_s) { return static_cast<Utime>(1e6 * duration_s); }

ekf::Sway sway(const EkfMotionParameters& motion) {
  return {motion.standing_sigma_m, motion.standing_sigma_rad};
}

bool is_usable(const Odometry& piece) {
  bool usable = piece.utime > piece.from_utime && piece.from_T_to.coordinates().allFinite() &&
                piece.covariance.allFinite() && piece.covariance.diagonal().minCoeff() >= 0.0;
  if (piece.inertial) {
    const Preintegration& p = *piece.inertial;
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
Eigen::Matrix3d pose_covariance(const ekf::FilterState& state, double pitch_tangent) {
  const Eigen::Matrix2d back = ekf::rotation_of(state.heading).transpose();
  Eigen::Matrix<double, 3, 4> pose_by_state = Eigen::Matrix<double, 3, 4>::Zero();
  pose_by_state.block<2, 1>(0, 0) = back * state.lever(state.position);
  pose_by_state.block<2, 2>(0, 1) = back;
  pose_by_state(2, 0) = 1.0;
  pose_by_state(2, 3) = -pitch_tangent;
  Eigen::Matrix4d covariance;
  covariance.topLeftCorner<3, 3>() = state.covariance_block<3, 3>(0, 0);
  covariance.topRightCorner<3, 1>() = state.covariance_block<3, 1>(0, ekf::kLevel);
  covariance.bottomLeftCorner<1, 3>() = covariance.topRightCorner<3, 1>().transpose();
  covariance(3, 3) = state.covariance(ekf::kLevel, ekf::kLevel);
  return pose_by_state * covariance * pose_by_state.transpose();
}

}  // namespace

Ekf::Ekf(const EkfParameters& parameters)
    : parameters_(parameters),
      state_(error_form(parameters.error_form), parameters.map.max_landmarks + ekf::kGroundMarks),
      room_(ekf::kVehicle + 2 * state_.max_landmarks()),
      joint_(state_.max_landmarks()),
      landmark_gate_(ekf::chi_squared_quantile(parameters.gate.landmark_probability, 2)),
      parked_gate_(ekf::chi_squared_quantile(kStandingProbability, 2 * ekf::kGroundMarks)),
      creeping_gate_(ekf::chi_squared_quantile(kStandingProbability, 3)),
      still_gate_(ekf::chi_squared_quantile(kStandingProbability, 2)) {
  const int capacity = ekf::kVehicle + 2 * state_.max_landmarks();
  backup_ = Eigen::MatrixXd::Zero(capacity, capacity);
  set_gates_.push_back(0.0);
  for (int k = 1; k <= parameters.map.max_landmarks; ++k) {
    set_gates_.push_back(ekf::chi_squared_quantile(parameters.gate.set_probability, 2 * k));
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
  covariance.diagonal()
      .segment<2>(ekf::kVelocity)
      .setConstant(prior.velocity_sigma_mps * prior.velocity_sigma_mps);
  const double gyro = prior.gyro_bias_sigma * prior.gyro_bias_sigma;
  const double force = prior.accelerometer_bias_sigma * prior.accelerometer_bias_sigma;
  covariance.diagonal().segment<3>(ekf::kBias) << gyro, force, force;
}

/// Until it is found to stand, which takes half a second, a vehicle may move at any speed, and turn
/// as the gyro's bias likes. A map that began before that would be off by as much for ever.
bool Ekf::may_begin(const Odometry& piece) {
  if (!heard_ || piece.utime < *heard_) heard_ = piece.from_utime;
  if (!piece.inertial || piece.is_standing) return true;
  if (piece.utime - *heard_ > microseconds(parameters_.prior.wait_s)) return true;
  const double spread = piece.covariance.topLeftCorner<2, 2>().trace();
  return piece.has_wheels && piece.from_T_to.translation().squaredNorm() > kMoves * spread;
}

void Ekf::start(Utime utime) {
  started_ = true;
  heard_.reset();
  utime_ = utime;
  set_prior();
  state_.set_pose_covariance(kStartVariance * Eigen::Matrix3d::Identity());
  last_sound_ = pose();
  pose_sequence_ = 0;
}

void Ekf::restart(Utime utime, const std::string& reason) {
  ++counters_.restarts;
  ++reset_counter_;
  counters_.last_reason = reason;
  refused_scans_ = 0;
  doubted_.reset();
  utime_ = utime;
  set_prior();
  const EkfPose& last = last_sound_;
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

EkfOutput Ekf::add(const Odometry& piece) {
  ++counters_.odometry;
  if (!is_usable(piece)) {
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry is not finite";
    return {};
  }
  if (!started_ && !may_begin(piece)) return {};
  if (!started_) start(piece.from_utime);
  const Utime newest = waiting_.empty() ? utime_ : waiting_.back().utime;
  if (piece.utime < newest - microseconds(parameters_.restart.clock_jump_s)) {
    waiting_.clear();
    last_scan_.reset();
    restart(piece.from_utime, "the clock jumped back");
  } else if (piece.from_utime < newest - kTolerance_us) {
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry is late or overlaps";
    return {};
  }
  waiting_.push_back(piece);
  const Utime overdue = piece.utime - microseconds(parameters_.max_scan_delay_s);
  if (waiting_.front().utime > overdue) return {};
  advance(overdue);
  used_ = refused_ = 0;
  EkfOutput output;
  output.pose = pose();
  output.level = level();
  if (waiting_.empty() ? piece.is_standing : waiting_.front().is_standing) {
    output.correction = outputs().correction;
  }
  return output;
}

/// Uses the odometry that ends by `utime`.
void Ekf::advance(Utime utime) {
  while (!waiting_.empty() && waiting_.front().utime <= utime + kTolerance_us) {
    use(waiting_.front());
    waiting_.pop_front();
  }
}

void Ekf::use(const Odometry& piece) {
  if (piece.utime <= utime_ + kTolerance_us) {
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry came after the scan at its end";
    return;
  }
  if (piece.from_utime < utime_ - kTolerance_us) {
    // The piece began before a scan that came without it: what is left of it is unknown.
    ++counters_.odometry_refused;
    counters_.last_reason = "odometry overlaps a scan";
    bridge(piece.utime);
    return;
  }
  if (piece.from_utime > utime_ + kTolerance_us) bridge(piece.from_utime);
  const EkfMotionParameters& motion = parameters_.motion;
  const bool stands = believes_standing(piece);
  const bool has_marks = ekf::has_ground_marks(state_);
  if (stands && !has_marks) ekf::add_ground_marks(state_, sway(motion));
  if (!stands && has_marks) leave_place();
  predict(piece, stands);
  if (stands) {
    stand();
  } else if (motion.sideways_sigma_mps > 0.0) {
    ekf::measure_no_slide(state_, motion.sideways_sigma_mps, room_);
  }
  if (!stands) way_m_ += piece.from_T_to.translation().norm();
  utime_ = piece.utime;
  state_.follow_with_anchor();
  if (!state_.is_sound()) restart(utime_, "the state was not finite after a prediction");
}

void Ekf::predict(const Odometry& piece, bool stands) {
  const EkfMotionParameters& motion = parameters_.motion;
  if (piece.inertial) {
    if (!level_covariance_) ekf::know_level(state_, piece.inertial->level);
    level_covariance_ = piece.inertial->level.covariance;
    pitch_tangent_ = piece.inertial->level.pitch_tangent;
  }
  if (!piece.inertial) {
    const SE2WithCovariance moved{piece.from_T_to, piece.covariance};
    const double duration = seconds(piece.utime - piece.from_utime);
    ekf::predict(state_, ekf::transition_by(state_, moved, duration, motion), motion, room_);
  } else if (piece.has_wheels && !stands) {
    const Eigen::Matrix2d turn = piece.from_T_to.rotation();
    const ekf::MeasuredMotion measured{
        piece.from_T_to.translation(),
        turn * piece.covariance.topLeftCorner<2, 2>() * turn.transpose()};
    ekf::predict(state_, *piece.inertial, measured, motion, room_);
  } else {
    ekf::predict(state_, ekf::transition_by(state_, *piece.inertial), motion, room_);
  }
}

/// Standing is told by quiet samples alone, where there are no wheels: a smooth road is quiet too.
/// So it is not believed against the filter's own velocity, nor, once found wrong, before it is
/// said to move; but after a while in which no landmark spoke for moving, the filter must be wrong.
bool Ekf::believes_standing(const Odometry& piece) {
  if (!piece.is_standing) doubted_.reset();
  if (!piece.is_standing) return false;
  if (doubted_) {
    if (piece.utime - *doubted_ < microseconds(kInsistence_s)) return false;
    doubted_.reset();
    const double unknown = parameters_.prior.velocity_sigma_mps;
    state_.covariance().diagonal().segment<2>(ekf::kVelocity).array() += unknown * unknown;
    return true;
  }
  const double sigma = parameters_.motion.standing_sigma_mps;
  Eigen::Matrix2d spread = state_.velocity_covariance().topLeftCorner<2, 2>();
  spread.diagonal().array() += sigma * sigma;
  const Eigen::Vector2d velocity = ekf::rotation_of(state_.heading).transpose() * state_.velocity;
  if (velocity.dot(spread.inverse() * velocity) <= still_gate_) return true;
  doubt_standing();
  return false;
}

void Ekf::doubt_standing() {
  ++counters_.crept;
  doubted_ = utime_;
  leave_place();
}

/// While it stood, landmarks were where they seemed to be from there; from elsewhere they will seem
/// to be somewhere else.
void Ekf::leave_place() {
  ekf::remove_ground_marks(state_);
  for (std::size_t i = 0; i < state_.landmarks().size(); ++i) {
    const ekf::MapLandmark& landmark = state_.landmarks()[i];
    if (landmark.seen_at_m < way_m_) continue;
    state_.loosen_landmark(i, parameters_.sighting.lasting_share * landmark.seen_variance_m2);
  }
}

/// The vehicle is where it was parked, and its velocity is that of its sway.
void Ekf::stand() {
  const EkfMotionParameters& motion = parameters_.motion;
  ekf::measure_standing(state_, motion.standing_sigma_mps, room_);
  if (ekf::measure_ground_marks(state_, sway(motion), parked_gate_, joint_, room_)) return;
  // A door was slammed, say.
  ekf::remove_ground_marks(state_);
  ekf::add_ground_marks(state_, sway(motion));
}

/// Nothing tells the motion until `utime`.
void Ekf::bridge(Utime utime) {
  ++counters_.gaps;
  ekf::remove_ground_marks(state_);  // It may have been driven on and parked again.
  const double duration = seconds(utime - utime_);
  if (duration > parameters_.restart.max_gap_s) return restart(utime, "too long a gap");
  way_m_ += state_.velocity.norm() * duration;
  ekf::predict(state_, ekf::transition_over_gap(state_, duration, parameters_.motion),
               parameters_.motion, room_);
  utime_ = utime;
}

/// The state's heading is that of the frame that sweeps and odometry are levelled to. A wrong roll
/// turns it by as much times the pitch's tangent: up and down with every slope, not the vehicle.
/// A scale that sightings have in common makes the whole map, with the vehicle in it, larger or
/// smaller about its origin. No sighting tells that, so the state does without it.
EkfPose Ekf::pose() {
  EkfPose out;
  out.utime = utime_;
  out.sequence = pose_sequence_++;
  const SE2 pose = state_.pose();
  const double turned = pitch_tangent_ * state_.level.x();
  out.ekf_map_T_vehicle = SE2(pose.x(), pose.y(), wrap_angle(pose.theta() - turned));
  out.covariance = pose_covariance(state_, pitch_tangent_);
  const Eigen::Matrix<double, 5, 5> motion = state_.velocity_covariance();
  out.velocity_mps = ekf::rotation_of(state_.heading).transpose() * state_.velocity;
  out.velocity_covariance = motion.topLeftCorner<2, 2>();
  out.bias = state_.bias;
  out.bias_covariance = motion.bottomRightCorner<3, 3>();
  out.landmarks_used = used_;
  out.landmarks_refused = refused_;
  out.reset_counter = reset_counter_;
  last_sound_ = out;
  const Eigen::Vector2d off =
      out.ekf_map_T_vehicle.inverse().translation() * parameters_.sighting.scale_sigma;
  out.covariance.topLeftCorner<2, 2>() += off * off.transpose();
  return out;
}

/// Of the latest pose.
std::optional<EkfLevel> Ekf::level() const {
  if (!level_covariance_) return std::nullopt;
  return EkfLevel{utime_, last_sound_.sequence, state_.level,
                  state_.covariance_block<2, 2>(ekf::kLevel, ekf::kLevel), *level_covariance_};
}

EkfOutput Ekf::outputs() {
  EkfOutput out;
  out.pose = pose();
  out.level = level();
  EkfMap& map = out.map.emplace();
  map.utime = utime_;
  map.sequence = map_sequence_++;
  const auto& landmarks = state_.landmarks();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const ekf::MapLandmark& landmark = landmarks[i];
    if (landmark.is_ground_mark()) continue;
    const Eigen::Vector2d position = landmark.position + state_.anchor_m;
    const Eigen::Vector2d off = position * parameters_.sighting.scale_sigma;
    map.landmarks.push_back({landmark.id, position,
                             state_.landmark_covariance(i) + off * off.transpose(),
                             landmark.radius_m, landmark.kind, landmark.times_seen});
  }
  std::sort(map.landmarks.begin(), map.landmarks.end(),
            [](const EkfLandmark& a, const EkfLandmark& b) { return a.track_id < b.track_id; });
  VelocityCorrection& correction = out.correction.emplace();
  correction.utime = utime_;
  correction.sequence = out.pose->sequence;
  correction.velocity_mps = out.pose->velocity_mps;
  correction.bias = state_.bias;
  correction.covariance = state_.velocity_covariance();
  return out;
}

}  // namespace understory
