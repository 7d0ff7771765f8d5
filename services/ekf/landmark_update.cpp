#include "services/ekf/landmark_update.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace understory::ekf {

Eigen::Vector2d heading_row(const FilterState& state, std::size_t i) {
  if (state.form() == ErrorForm::kRightInvariant) return Eigen::Vector2d::Zero();
  const MapLandmark& landmark = state.landmarks()[i];
  if (state.form() == ErrorForm::kFirstEstimate) {
    return -geometry::perpendicular(landmark.first_position - state.first_position);
  }
  return -geometry::perpendicular(landmark.position - state.position);
}

Eigen::Matrix2d level_rows(const FilterState& state, double height_m) {
  return height_m * rotation_of(state.heading) * level_displacement();
}

Eigen::Vector2d innovation(const FilterState& state, std::size_t i,
                           const Observation& observation) {
  return rotation_of(state.heading) *
             (observation.position_m - observation.height_m * level_displacement() * state.level) -
         (state.landmarks()[i].position - state.position);
}

Eigen::Matrix2d innovation_covariance(const FilterState& state, std::size_t a, std::size_t b,
                                      double height_a_m, double height_b_m) {
  const int ra = FilterState::row(a);
  const int rb = FilterState::row(b);
  Eigen::Matrix2d sum =
      state.covariance_block<2, 2>(ra, rb) + state.covariance_block<2, 2>(kPosition, kPosition) -
      state.covariance_block<2, 2>(ra, kPosition) - state.covariance_block<2, 2>(kPosition, rb);

  // The level's part.
  const Eigen::Matrix2d la = level_rows(state, height_a_m);
  const Eigen::Matrix2d lb = level_rows(state, height_b_m);
  const Eigen::Matrix2d a_level =
      state.covariance_block<2, 2>(ra, kLevel) - state.covariance_block<2, 2>(kPosition, kLevel);
  const Eigen::Matrix2d b_level =
      state.covariance_block<2, 2>(rb, kLevel) - state.covariance_block<2, 2>(kPosition, kLevel);
  sum += a_level * lb.transpose() + la * b_level.transpose() +
         la * state.covariance_block<2, 2>(kLevel, kLevel) * lb.transpose();
  if (state.form() == ErrorForm::kRightInvariant) return sum;

  // The heading's part.
  const Eigen::Vector2d ha = heading_row(state, a);
  const Eigen::Vector2d hb = heading_row(state, b);
  const Eigen::Vector2d a_heading = state.covariance_block<2, 1>(ra, kHeading) -
                                    state.covariance_block<2, 1>(kPosition, kHeading);
  const Eigen::Vector2d b_heading = state.covariance_block<2, 1>(rb, kHeading) -
                                    state.covariance_block<2, 1>(kPosition, kHeading);
  sum += a_heading * hb.transpose() + ha * b_heading.transpose() +
         state.covariance(0, 0) * ha * hb.transpose();
  const Eigen::RowVector2d heading_level = state.covariance_block<1, 2>(kHeading, kLevel);
  sum += ha * heading_level * lb.transpose() + la * heading_level.transpose() * hb.transpose();
  return sum;
}

double squared_distance(const FilterState& state, std::size_t i, const Observation& observation) {
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  const Eigen::Vector2d error = innovation(state, i, observation);
  const Eigen::Matrix2d spread =
      innovation_covariance(state, i, i, observation.height_m, observation.height_m) +
      rotation * observation.covariance_m2 * rotation.transpose();
  return error.dot(spread.inverse() * error);
}

JointUpdate::JointUpdate(int max_landmarks) : vehicle_(kVehicle + 2 * max_landmarks, 5) {}

double JointUpdate::apply(FilterState& state, std::span<const Observation> observations,
                          std::span<const Pairing> pairings, LowRank& low_rank) {
  low_rank.start(state.size());
  constexpr std::size_t kStep = kMaxRows / 2;

  double distance = 0.0;
  for (std::size_t at = 0; at < pairings.size(); at += kStep) {
    const std::size_t count = std::min(kStep, pairings.size() - at);
    const double step = apply_some(state, observations, pairings.subspan(at, count), low_rank);
    if (step < 0.0) return -1.0;
    distance += step;
  }
  return distance;
}

double JointUpdate::apply_some(FilterState& state, std::span<const Observation> observations,
                               std::span<const Pairing> pairings, LowRank& low_rank) {
  const int n = state.size();
  const int rows = 2 * static_cast<int>(pairings.size());
  const bool is_invariant = state.form() == ErrorForm::kRightInvariant;
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  for (int k = 0; k < 3; ++k) state.copy_column(k, vehicle_.col(k).head(n));
  for (int k = 0; k < 2; ++k) state.copy_column(kLevel + k, vehicle_.col(3 + k).head(n));

  // Innovations, without the corrections of earlier steps, and their covariance with the state.
  auto cross = low_rank.cross(n, rows);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1> error(rows);
  for (int k = 0; k < rows; k += 2) {
    const Pairing& pairing = pairings[static_cast<std::size_t>(k / 2)];
    const Observation& observation = observations[pairing.observation];
    const int at = FilterState::row(pairing.landmark);
    const Eigen::Vector2d heading = heading_row(state, pairing.landmark);
    const Eigen::Matrix2d level = level_rows(state, observation.height_m);
    auto delta = low_rank.delta(n);
    error.segment<2>(k) = innovation(state, pairing.landmark, observation) -
                          (delta.segment<2>(at) - delta.segment<2>(kPosition) +
                           heading * delta(kHeading) + level * delta.segment<2>(kLevel));
    for (int r = 0; r < 2; ++r) {
      state.copy_column(at + r, cross.col(k + r));
      cross.col(k + r) -= vehicle_.col(kPosition + r).head(n);
      cross.col(k + r) +=
          level(r, 0) * vehicle_.col(3).head(n) + level(r, 1) * vehicle_.col(4).head(n);
      if (!is_invariant) cross.col(k + r) += heading(r) * vehicle_.col(kHeading).head(n);
    }
  }

  // Covariance of the innovations.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxRows> spread(rows, rows);
  for (int k = 0; k < rows; k += 2) {
    const Pairing& pairing = pairings[static_cast<std::size_t>(k / 2)];
    const Observation& observation = observations[pairing.observation];
    const int at = FilterState::row(pairing.landmark);
    const Eigen::Matrix2d level = level_rows(state, observation.height_m);
    spread.middleRows<2>(k) = cross.middleRows<2>(at) - cross.middleRows<2>(kPosition) +
                              level * cross.middleRows<2>(kLevel);
    if (!is_invariant) {
      spread.middleRows<2>(k) += heading_row(state, pairing.landmark) * cross.row(kHeading);
    }
    spread.block<2, 2>(k, k) += rotation * observation.covariance_m2 * rotation.transpose();
  }
  return low_rank.apply(state, error, spread);
}

}  // namespace understory::ekf
