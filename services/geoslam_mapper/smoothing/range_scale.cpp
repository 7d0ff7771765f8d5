#include "services/geoslam_mapper/smoothing/range_scale.hpp"

#include <cmath>

#include "common/geometry/alignment.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Fewest landmarks for a position: errors of single ones average out.
constexpr std::size_t kLeastLandmarks = 6;
/// Squared Mahalanobis distance (2 degrees of freedom) above which a motion is ignored.
constexpr double kContradicts = 25.0;

double squared(double value) { return value * value; }

}  // namespace

void RangeScale::add(const LocatedKeyframe& located,
                     const std::optional<geometry::SE2WithCovariance>& odometry) {
  const std::optional<LocatedKeyframe> before = std::exchange(last_, located);
  if (!before || !odometry || range_sigma_ <= 0.0) return;

  const Eigen::Vector2d by_landmarks =
      (before->map_T_vehicle.inverse() * located.map_T_vehicle).translation();
  const Eigen::Vector2d by_odometry = odometry->mean.translation();
  const double noise_m2 = 0.5 * odometry->covariance.topLeftCorner<2, 2>().trace();
  const double variance_m2 = noise_m2 + before->variance_m2 + located.variance_m2;
  if (variance_m2 <= 0.0) return;
  const double off = (by_landmarks - odometry_factor() * by_odometry).squaredNorm() / variance_m2;
  if (off > kContradicts) return;

  // Noise of odometry biases its squared length, but not the product.
  const double squared_m2 = by_odometry.squaredNorm() - 2.0 * noise_m2;
  if (squared_m2 <= 0.0) return;
  products_ += by_landmarks.dot(by_odometry) / variance_m2;
  squares_ += squared_m2 / variance_m2;
}

RangeScale RangeScale::beside() const {
  RangeScale other = *this;
  other.last_.reset();
  other.is_held_ = false;
  return other;
}

double RangeScale::odometry_factor() const {
  if (!is_estimated()) return 1.0;
  const double prior = squared(range_sigma_) + squared(odometry_sigma_);
  return 1.0 + ratio_error() * prior / (prior + ratio_variance());
}

/// The ratio is the range's scale divided by odometry's: it is split between them by their prior
/// variances.
double RangeScale::range_error() const {
  if (!is_estimated()) return 0.0;
  const double prior = squared(range_sigma_);
  return ratio_error() * prior / (prior + squared(odometry_sigma_) + ratio_variance());
}

double RangeScale::sigma() const {
  if (range_sigma_ <= 0.0 || is_held_) return 0.0;
  if (!is_estimated()) return range_sigma_;
  const double other = squared(odometry_sigma_) + ratio_variance();
  return range_sigma_ * std::sqrt(other / (squared(range_sigma_) + other));
}

std::optional<LocatedKeyframe> located_by_landmarks(
    const model::Keyframe& keyframe, std::span<const model::Association> associations,
    std::span<const Eigen::Vector2d> positions_m) {
  if (associations.size() < kLeastLandmarks) return std::nullopt;
  geometry::RigidAlignment2 alignment;
  for (std::size_t i = 0; i < associations.size(); ++i) {
    const model::KeyframeLandmark& observed = keyframe.landmarks[associations[i].keyframe_landmark];
    alignment.add(positions_m[i], observed.position_m, 2.0 / observed.covariance_m2.trace());
  }

  const model::KeyframeMember& last = keyframe.members.back();
  return LocatedKeyframe{last.utime, alignment.a_T_b() * last.centre_T_vehicle,
                         1.0 / alignment.weight()};
}

}  // namespace understory::geoslam_mapper::smoothing
