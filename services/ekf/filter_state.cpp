#include "services/ekf/filter_state.hpp"

#include <algorithm>
#include <cmath>

namespace understory::ekf {
namespace {

constexpr double kAnchorReach_m = 150.0;

/// V with Exp(rho, t) = (V rho, t): the translation part of the exponential map.
Eigen::Matrix2d translation_map(double angle) {
  const geometry::SE2 x = geometry::SE2::Exp({1.0, 0.0, angle});
  return (Eigen::Matrix2d() << x.x(), -x.y(), x.y(), x.x()).finished();
}

}  // namespace

Eigen::Matrix2d quarter_turn() { return (Eigen::Matrix2d() << 0.0, -1.0, 1.0, 0.0).finished(); }
Eigen::Matrix2d level_displacement() { return -quarter_turn(); }
Eigen::Matrix2d rotation_of(double heading) { return geometry::SE2(0.0, 0.0, heading).rotation(); }

FilterState::FilterState(ErrorForm form, int max_landmarks)
    : form_(form), max_landmarks_(max_landmarks) {
  landmarks_.reserve(static_cast<std::size_t>(max_landmarks));
  const Eigen::Index capacity = padded(kVehicle + 2 * max_landmarks);
  covariance_ = Eigen::MatrixXd::Zero(capacity, capacity);
}

Eigen::Vector2d FilterState::lever(const Eigen::Vector2d& x) const {
  if (form_ == ErrorForm::kRightInvariant) return geometry::perpendicular(x);
  return Eigen::Vector2d::Zero();
}

void FilterState::retract(const Eigen::Ref<const Eigen::VectorXd>& delta) {
  const double rotation = delta(kHeading);
  const bool invariant = form_ == ErrorForm::kRightInvariant;
  const Eigen::Matrix2d whole = invariant ? rotation_of(rotation) : Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d part = invariant ? translation_map(rotation) : Eigen::Matrix2d::Identity();
  const auto move = [&](Eigen::Vector2d& x, int at) {
    x = whole * x + part * delta.segment<2>(at);
  };

  heading = geometry::wrap_angle(heading + rotation);
  move(position, kPosition);
  move(velocity, kVelocity);
  bias += delta.segment<3>(kBias);
  level += delta.segment<2>(kLevel);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) move(landmarks_[i].position, row(i));
}

void FilterState::add_landmark(const MapLandmark& landmark, const Eigen::Vector2d& in_vehicle,
                               const Eigen::Matrix2d& variance, double height_m) {
  const int n = size();
  const Eigen::Matrix2d rotation = rotation_of(heading);
  const Eigen::Matrix2d by_level = height_m * rotation * level_displacement();
  const Eigen::Vector2d offset = rotation * in_vehicle - by_level * level;

  landmarks_.push_back(landmark);
  MapLandmark& added = landmarks_.back();
  added.position = position + offset;
  added.first_position = added.position;

  // Its error: the position's, plus the heading's times the offset (zero if right invariant), minus
  // the level's, plus noise.
  const Eigen::Vector2d by_heading =
      geometry::perpendicular(offset) + lever(position) - lever(added.position);
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 2; ++k) {
      covariance_(n + k, i) =
          covariance(kPosition + k, i) + by_heading(k) * covariance(kHeading, i) -
          by_level(k, 0) * covariance(kLevel, i) - by_level(k, 1) * covariance(kLevel + 1, i);
    }
  }

  const Eigen::Matrix2d noise = rotation * variance * rotation.transpose();
  for (int c = 0; c < 2; ++c) {
    for (int r = c; r < 2; ++r) {
      covariance_(n + r, n + c) = covariance_(n + r, kPosition + c) +
                                  by_heading(c) * covariance_(n + r, kHeading) -
                                  by_level(c, 0) * covariance_(n + r, kLevel) -
                                  by_level(c, 1) * covariance_(n + r, kLevel + 1) + noise(r, c);
    }
  }
}

void FilterState::remove_landmark(std::size_t i) {
  const int n = size();
  const int at = row(i);
  for (int c = 0; c < at; ++c) {
    for (int r = at + 2; r < n; ++r) covariance_(r - 2, c) = covariance_(r, c);
  }
  for (int c = at + 2; c < n; ++c) {
    for (int r = c; r < n; ++r) covariance_(r - 2, c - 2) = covariance_(r, c);
  }
  landmarks_.erase(landmarks_.begin() + static_cast<std::ptrdiff_t>(i));
}

void FilterState::follow_with_anchor() {
  if (position.norm() < kAnchorReach_m) return;

  // With x = y + d, the error d_x - t S x becomes d_y - t S y by adding t S d.
  const Eigen::Vector2d shift = position;
  const Eigen::Vector2d arm = lever(shift);
  const int n = size();
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(n);
  moved.segment<2>(kPosition) = arm;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) moved.segment<2>(row(i)) = arm;

  Eigen::VectorXd heading_column(n);
  copy_column(kHeading, heading_column);
  const double variance = heading_column(0);
  heading_column += 0.5 * variance * moved;
  covariance().selfadjointView<Eigen::Lower>().rankUpdate(moved, heading_column);

  position -= shift;
  first_position -= shift;
  anchor_m += shift;
  for (MapLandmark& landmark : landmarks_) {
    landmark.position -= shift;
    landmark.first_position -= shift;
  }
}

}  // namespace understory::ekf
