#include "services/ekf/ground_marks.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

namespace understory::ekf {
namespace {

/// The marks as observed from the parked vehicle. Their noise and distance are chosen such that
/// together they measure the position with variance sigma_m^2 per axis and the heading with
/// sigma_rad^2.
std::array<Observation, kGroundMarks> observations(const Sway& sway) {
  const double reach = sway.sigma_m / sway.sigma_rad;
  const Eigen::Matrix2d noise = 2.0 * sway.sigma_m * sway.sigma_m * Eigen::Matrix2d::Identity();
  return {Observation{{reach, 0.0}, noise}, Observation{{-reach, 0.0}, noise}};
}

bool is_mark(const MapLandmark& landmark) { return landmark.is_ground_mark(); }

}  // namespace

bool has_ground_marks(const FilterState& state) {
  return std::any_of(state.landmarks().begin(), state.landmarks().end(), is_mark);
}

void add_ground_marks(FilterState& state, const Sway& sway) {
  for (const Observation& mark : observations(sway)) {
    state.add_landmark(MapLandmark{}, mark.position_m, mark.covariance_m2);
  }
}

void remove_ground_marks(FilterState& state) {
  for (std::size_t i = state.landmarks().size(); i-- > 0;) {
    if (is_mark(state.landmarks()[i])) state.remove_landmark(i);
  }
}

bool measure_ground_marks(FilterState& state, const Sway& sway, double gate, JointUpdate& joint,
                          LowRank& low_rank) {
  const auto marks = observations(sway);
  const auto& landmarks = state.landmarks();
  std::array<Pairing, kGroundMarks> pairings;
  std::uint32_t found = 0;
  for (std::uint32_t i = 0; i < landmarks.size() && found < kGroundMarks; ++i) {
    if (is_mark(landmarks[i])) pairings[found] = {found, i}, ++found;
  }

  // Innovations and their covariance.
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  Eigen::Vector4d error;
  Eigen::Matrix4d spread;
  for (std::uint32_t a = 0; a < kGroundMarks; ++a) {
    error.segment<2>(2 * a) = innovation(state, pairings[a].landmark, marks[a]);
    for (std::uint32_t b = 0; b < kGroundMarks; ++b) {
      spread.block<2, 2>(2 * a, 2 * b) =
          innovation_covariance(state, pairings[a].landmark, pairings[b].landmark);
    }
    spread.block<2, 2>(2 * a, 2 * a) += rotation * marks[a].covariance_m2 * rotation.transpose();
  }

  // Gate, then update.
  if (!(error.dot(spread.llt().solve(error)) <= gate)) return false;
  if (joint.apply(state, marks, pairings, low_rank) < 0.0) return false;
  joint.finish(state, low_rank);
  return true;
}

double common_motion(const FilterState& state, std::span<const Observation> observations,
                     std::span<const Pairing> pairings) {
  const int rows = 2 * static_cast<int>(pairings.size());
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  Eigen::VectorXd error(rows);
  Eigen::MatrixXd spread(rows, rows);
  Eigen::MatrixX3d motion(rows, 3);

  // Innovations, their covariance, and their Jacobian by a motion of the vehicle.
  for (int a = 0; a < rows; a += 2) {
    const Pairing& pairing = pairings[static_cast<std::size_t>(a / 2)];
    const Observation& observation = observations[pairing.observation];
    error.segment<2>(a) = innovation(state, pairing.landmark, observation);
    motion.block<2, 2>(a, 0).setIdentity();
    motion.block<2, 1>(a, 2) = geometry::perpendicular(rotation * observation.position_m);
    for (int b = 0; b <= a; b += 2) {
      const Pairing& other = pairings[static_cast<std::size_t>(b / 2)];
      spread.block<2, 2>(a, b) =
          innovation_covariance(state, pairing.landmark, other.landmark, observation.height_m,
                                observations[other.observation].height_m);
    }
    spread.block<2, 2>(a, a) += rotation * observation.covariance_m2 * rotation.transpose();
  }

  // Weighted least squares for the motion.
  const Eigen::LLT<Eigen::MatrixXd> factor(spread);
  const Eigen::MatrixX3d weighted = factor.solve(motion);
  const Eigen::Vector3d weighted_error = weighted.transpose() * error;
  return weighted_error.dot((motion.transpose() * weighted).eval().llt().solve(weighted_error));
}

}  // namespace understory::ekf
