// A filter state with everything in it, and textbook formulas to hold it to.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

#include "services/ekf/filter_state.hpp"

namespace understory::test {

using ekf::ErrorForm;
using ekf::FilterState;

inline constexpr ErrorForm kForms[] = {ErrorForm::kRightInvariant, ErrorForm::kFirstEstimate,
                                       ErrorForm::kPlain};

inline double normal(std::mt19937_64& random) { return std::normal_distribution<double>()(random); }

/// A random estimate with a random full covariance. First estimates are the estimates.
inline FilterState random_state(ErrorForm form, int landmarks, std::mt19937_64& random) {
  FilterState state(form, landmarks + 4);
  state.heading = normal(random);
  state.position = 20.0 * Eigen::Vector2d(normal(random), normal(random));
  state.velocity = 3.0 * Eigen::Vector2d(normal(random), normal(random));
  state.bias = 0.1 * Eigen::Vector3d(normal(random), normal(random), normal(random));
  state.level = 0.02 * Eigen::Vector2d(normal(random), normal(random));
  state.first_position = state.position;
  state.first_velocity = state.velocity;
  for (int i = 0; i < landmarks; ++i) {
    ekf::MapLandmark landmark;
    landmark.id = static_cast<model::TrackId>(i + 1);
    state.add_landmark(landmark, 20.0 * Eigen::Vector2d(normal(random), normal(random)),
                       Eigen::Matrix2d::Identity());
  }
  const int n = state.size();
  Eigen::MatrixXd root(n, n);
  for (int k = 0; k < n * n; ++k) root.data()[k] = normal(random);
  const Eigen::MatrixXd full = 0.01 * root * root.transpose();
  state.covariance() = full.triangularView<Eigen::Lower>().toDenseMatrix();
  return state;
}

/// The covariance with both its triangles.
inline Eigen::MatrixXd full_covariance(const FilterState& state) {
  return state.covariance().selfadjointView<Eigen::Lower>();
}

/// The error that takes `from` to `to`, to first order.
inline Eigen::VectorXd difference(const FilterState& from, const FilterState& to) {
  Eigen::VectorXd delta(from.size());
  const double rotation = geometry::wrap_angle(to.heading - from.heading);
  const auto of = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return Eigen::Vector2d(b - a - rotation * from.lever(a));
  };
  delta(0) = rotation;
  delta.segment<2>(ekf::kPosition) = of(from.position, to.position);
  delta.segment<2>(ekf::kVelocity) = of(from.velocity, to.velocity);
  delta.segment<3>(ekf::kBias) = to.bias - from.bias;
  delta.segment<2>(ekf::kLevel) = to.level - from.level;
  for (std::size_t i = 0; i < from.landmarks().size(); ++i) {
    delta.segment<2>(FilterState::row(i)) =
        of(from.landmarks()[i].position, to.landmarks()[i].position);
  }
  return delta;
}

}  // namespace understory::test
