#include "services/ekf/stationary_monitor.hpp"

#include <Eigen/LU>
#include <vector>

#include "services/ekf/prediction.hpp"
#include "services/ekf/state_covariances.hpp"
#include "services/ekf/timeline.hpp"

namespace understory::ekf {
namespace {

/// Time after which a doubted `is_stationary` is accepted again [s].
constexpr double kInsistence_s = 10.0;
/// Fewest landmarks of a scan that prove the vehicle's motion.
constexpr std::uint32_t kFewLandmarks = 3;
/// Fewest known landmarks of a scan for a majority against the map.
constexpr std::size_t kFewKnown = 4;

}  // namespace

StationaryMonitor::StationaryMonitor(const EkfParameters& parameters, const StationaryGates& gates)
    : gates_(gates),
      sway_{parameters.motion.stationary_sigma_m, parameters.motion.stationary_sigma_rad},
      velocity_sigma_mps_(parameters.motion.stationary_sigma_mps),
      prior_velocity_sigma_mps_(parameters.prior.velocity_sigma_mps),
      correlated_share_(parameters.observation.correlated_share) {}

bool StationaryMonitor::is_stationary(const model::Odometry& increment, model::Utime now,
                                      double distance_m, FilterState& state) {
  const bool is_stationary = believes(increment, now, distance_m, state);
  const bool has_marks = has_ground_marks(state);
  if (is_stationary && !has_marks) add_ground_marks(state, sway_);
  if (!is_stationary && has_marks) leave_place(distance_m, state);
  return is_stationary;
}

bool StationaryMonitor::believes(const model::Odometry& increment, model::Utime now,
                                 double distance_m, FilterState& state) {
  if (!increment.is_stationary) {
    doubted_.reset();
    return false;
  }

  // Doubted for long: the filter's velocity is wrong instead.
  if (doubted_) {
    if (increment.utime - *doubted_ < microseconds(kInsistence_s)) return false;
    doubted_.reset();
    const double unknown = prior_velocity_sigma_mps_;
    state.covariance().diagonal().segment<2>(kVelocity).array() += unknown * unknown;
    return true;
  }

  // Compares with the filter's own velocity.
  Eigen::Matrix2d spread = velocity_covariance(state).topLeftCorner<2, 2>();
  spread.diagonal().array() += velocity_sigma_mps_ * velocity_sigma_mps_;
  const Eigen::Vector2d velocity = rotation_of(state.heading).transpose() * state.velocity;
  if (velocity.dot(spread.inverse() * velocity) <= gates_.velocity) return true;
  doubt(now, distance_m, state);
  return false;
}

void StationaryMonitor::hold(FilterState& state, UpdateScratch& scratch) const {
  measure_stationary(state, velocity_sigma_mps_, scratch.low_rank);
  if (measure_ground_marks(state, sway_, gates_.ground_marks, scratch.joint, scratch.low_rank)) {
    return;
  }
  remove_ground_marks(state);
  add_ground_marks(state, sway_);
}

bool StationaryMonitor::is_creeping(const FilterState& state,
                                    std::span<const Observation> observations,
                                    std::span<const Pairing> known, double landmark_gate) const {
  if (!has_ground_marks(state)) return false;

  std::size_t near = 0;
  std::vector<Pairing> pairings;
  for (const Pairing& pairing : known) {
    const Observation& observation = observations[pairing.observation];
    if (squared_distance(state, pairing.landmark, observation) > landmark_gate) continue;
    ++near;
    if (pairings.size() < kMaxRows / 2) pairings.push_back(pairing);
  }

  if (known.size() >= kFewKnown && 2 * near < known.size()) return true;
  return pairings.size() >= 2 &&
         !(common_motion(state, observations, pairings) <= gates_.common_motion);
}

void StationaryMonitor::doubt(model::Utime now, double distance_m, FilterState& state) {
  doubted_ = now;
  leave_place(distance_m, state);
}

void StationaryMonitor::confirm_motion(model::Utime now, std::uint32_t landmarks_used) {
  if (doubted_ && landmarks_used >= kFewLandmarks) doubted_ = now;
}

/// While the vehicle was stationary, the correlated errors of its landmarks were not added. From
/// another place these errors differ: the variance of the landmarks grows by them.
void StationaryMonitor::leave_place(double distance_m, FilterState& state) const {
  remove_ground_marks(state);
  for (std::size_t i = 0; i < state.landmarks().size(); ++i) {
    const MapLandmark& landmark = state.landmarks()[i];
    if (landmark.observed_at_m < distance_m) continue;
    state.covariance().diagonal().segment<2>(FilterState::row(i)).array() +=
        correlated_share_ * landmark.observed_variance_m2;
  }
}

}  // namespace understory::ekf
