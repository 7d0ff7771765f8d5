#include "services/geoslam_mapper/smoothing/gyro_bias.hpp"

#include <Eigen/LU>
#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Validity of one scalar: in this time the bias walks by a third of its smallest uncertainty.
constexpr model::Utime kValidity_us = 5'000'000;

double seconds(model::Utime duration) { return 1e-6 * static_cast<double>(duration); }

/// The covariance with the gyro's variance for the rotation; correlations are kept.
Eigen::Matrix3d with_heading_variance(Eigen::Matrix3d covariance, double variance) {
  const double ratio = std::sqrt(variance / covariance(2, 2));
  covariance.row(2) *= ratio;
  covariance.col(2) *= ratio;
  return covariance;
}

}  // namespace

void GyroBias::learn_from(const model::FilterBias& filter, model::Utime utime,
                          factor_graph::plane::Smoother& smoother) {
  if (!newest_) {
    reference_ = filter.bias;
    newest_ = Newest{smoother.add_scalar(0.0), utime};
    smoother.add(factor_graph::plane::ScalarPrior{newest_->id, 0.0, 1.0 / filter.variance});
    return;
  }

  // The next scalar of the chain.
  if (utime - newest_->since > kValidity_us) {
    const factor_graph::plane::ScalarId next = smoother.add_scalar(smoother.scalar(newest_->id));
    const double variance = walk_ * walk_ * seconds(utime - newest_->since);
    smoother.add(factor_graph::plane::ScalarStep{newest_->id, next, 1.0 / variance});
    newest_ = Newest{next, utime};
  }

  // What the filter learned while stationary is the difference of its two estimates.
  if (!was_stationary_) return;
  const double before = 1.0 / (before_.variance + walk_ * walk_ * seconds(utime - before_utime_));
  const double gained = 1.0 / filter.variance - before;
  if (gained <= 0.0) return;
  const double learned = (filter.bias / filter.variance - before_.bias * before) / gained;
  smoother.add(factor_graph::plane::ScalarPrior{newest_->id, learned - reference_, gained});
}

void GyroBias::add_motion(factor_graph::plane::RelativePose measured, const CentreMotion& motion,
                          factor_graph::plane::Smoother& smoother) {
  learn_from(*motion.filter_bias, motion.utime, smoother);
  was_stationary_ = false;
  before_ = *motion.filter_bias;
  before_utime_ = motion.utime;

  // As it would have been measured with the reference taken out.
  const model::GyroRotation& gyro = *motion.gyro;
  const geometry::SE2 by_gyro(motion.from_T_to.mean.translation(), gyro.rotation_rad);
  measured.a_T_b = factor_graph::plane::at_true_rate(
      by_gyro, reference_ - gyro.bias_rad / gyro.seconds, gyro.seconds);
  measured.information =
      with_heading_variance(motion.from_T_to.covariance, gyro.variance).inverse();
  smoother.add(factor_graph::plane::BiasedRelativePose{measured, newest_->id, gyro.seconds});
}

}  // namespace understory::geoslam_mapper::smoothing
