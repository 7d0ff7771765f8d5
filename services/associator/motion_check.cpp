#include "services/associator/motion_check.hpp"

#include <Eigen/LU>
#include <cmath>

#include "common/geometry/decompositions.hpp"

namespace understory::associator {
namespace {

/// chi^2 of 2 degrees of freedom: exceeded once in 100,000.
constexpr double kGate = 23.0;
/// Successive contradictions after which a track moves.
constexpr std::uint32_t kContradictions = 2;
/// Error of the difference of two observations that is missing in their covariances, per axis.
constexpr double kFloor_m = 0.03;

}  // namespace

void check_motion(Track& track, const Observation& observation, const MotionCheck& check,
                  const AssociatorParameters& parameters) {
  // Expected position of a stationary track, with its covariance.
  const geometry::SE2 now_T_then = check.then_T_now.mean.inverse();
  const Eigen::Vector2d expected = now_T_then * track.reference.position_m;
  Eigen::Matrix<double, 2, 3> by_motion;
  by_motion << Eigen::Matrix2d::Identity(), geometry::perpendicular(expected);
  const Eigen::Matrix2d rotation = now_T_then.rotation();
  const Eigen::Matrix2d spread = observation.covariance_m2 +
                                 rotation * track.reference.covariance_m2 * rotation.transpose() +
                                 by_motion * check.then_T_now.covariance * by_motion.transpose() +
                                 kFloor_m * kFloor_m * Eigen::Matrix2d::Identity();

  // Outside the gate.
  const Eigen::Vector2d off = observation.position_m - expected;
  if (off.dot(spread.inverse() * off) > kGate) {
    if (++track.moved_in_a_row >= kContradictions) track.steadiness = Steadiness::kMoves;
    return;
  }
  track.moved_in_a_row = 0;
  if (track.steadiness != Steadiness::kUnknown) return;

  // Inside: the track is stationary if a pedestrian would be outside the gate by now.
  const double widest = geometry::eigenvalues(spread).maxCoeff();
  const double noticed_m = std::sqrt(kGate * widest);
  const bool is_noticed = parameters.walking_mps * check.seconds > noticed_m;
  // A longer comparison would not decide it, either.
  if (is_noticed || check.seconds > kMaxComparison_s) track.steadiness = Steadiness::kStationary;
}

}  // namespace understory::associator
