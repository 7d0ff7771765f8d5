#include "services/associator/motion_check.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace understory::associator {
namespace {

/// chi^2 of 2 degrees of freedom: one in 100,000.
constexpr double kGate = 23.0;
/// Farther off in so many sightings in a row, it moves.
constexpr std::uint32_t kSightings = 2;
/// What of two sightings' errors their covariances do not know [m].
constexpr double kFloor_m = 0.03;

}  // namespace

void check_motion(Track& track, const Seen& seen, const MotionCheck& check,
                  const AssociatorParameters& parameters) {
  const geometry::SE2 now_T_then = check.then_T_now.mean.inverse();
  const Eigen::Vector2d expected = now_T_then * track.begin.position_m;
  Eigen::Matrix<double, 2, 3> by_motion;
  by_motion << Eigen::Matrix2d::Identity(), geometry::perpendicular(expected);
  const Eigen::Matrix2d turn = now_T_then.rotation();
  const Eigen::Matrix2d spread = seen.covariance_m2 +
                                 turn * track.begin.covariance_m2 * turn.transpose() +
                                 by_motion * check.then_T_now.covariance * by_motion.transpose() +
                                 kFloor_m * kFloor_m * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d off = seen.position_m - expected;
  if (off.dot(spread.inverse() * off) > kGate) {
    if (++track.times_off >= kSightings) track.steadiness = Steadiness::kMoves;
    return;
  }
  track.times_off = 0;
  if (track.steadiness != Steadiness::kUnknown) return;
  const double widest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread, Eigen::EigenvaluesOnly)
          .eigenvalues()
          .maxCoeff();
  const double noticed_m = std::sqrt(kGate * widest);
  const bool is_told = parameters.walking_mps * check.seconds > noticed_m;
  // Where so long a time does not tell, nothing will.
  if (is_told || check.seconds > kCompared_s) track.steadiness = Steadiness::kStationary;
}

}  // namespace understory::associator
