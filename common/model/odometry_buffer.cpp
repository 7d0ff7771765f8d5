#include "common/model/odometry_buffer.hpp"

#include <algorithm>
#include <cstdlib>

#include "common/model/preintegration.hpp"

namespace understory {
namespace {

/// Pieces from one source may miss each other by rounding of their stamps.
constexpr Utime kGapTolerance_us = 1000;

/// Errors of the filter's velocity last for about so long: they have the power tau * dt when pieces
/// are compounded.
constexpr double kVelocityLasts_s = 0.5;
constexpr std::size_t kMaxPieces = 20000;

bool begins_at(const Odometry& piece, Utime utime) {
  return std::abs(piece.from_utime - utime) <= kGapTolerance_us;
}

/// The piece's way, started at the given velocity.
SE2WithCovariance way_from(const KnownVelocity& start, const Preintegration& inertial) {
  const double dt = inertial.seconds;
  SE2WithCovariance motion;
  motion.mean = SE2(start.velocity_mps * dt + inertial.position_m, inertial.yaw_rad);
  Eigen::Matrix<double, 3, 5> of_noise = Eigen::Matrix<double, 3, 5>::Zero();
  const Eigen::Matrix2d back = motion.mean.rotation().transpose();
  of_noise.topRightCorner<2, 2>() = back;
  of_noise(2, 0) = 1.0;
  motion.covariance = of_noise * inertial.covariance * of_noise.transpose();
  motion.covariance.topLeftCorner<2, 2>() +=
      dt * std::max(dt, kVelocityLasts_s) * back * start.covariance * back.transpose();
  return motion;
}

/// The velocity at the piece's end.
KnownVelocity carried_over(const KnownVelocity& start, const Odometry& piece,
                           const Preintegration& inertial) {
  const Eigen::Matrix2d back = SE2(0.0, 0.0, inertial.yaw_rad).rotation().transpose();
  KnownVelocity end = start;
  end.utime = piece.utime;
  end.velocity_mps = back * (start.velocity_mps + inertial.velocity_mps);
  end.covariance =
      back * (start.covariance + inertial.covariance.block<2, 2>(1, 1)) * back.transpose();
  return end;
}

SE2WithCovariance part(const Odometry& piece, Utime from, Utime to) {
  const double fraction =
      static_cast<double>(to - from) / static_cast<double>(piece.utime - piece.from_utime);
  if (fraction >= 1.0) return {piece.from_T_to, piece.covariance};
  return {SE2::Exp(fraction * piece.from_T_to.Log()), fraction * piece.covariance};
}

/// The piece as it would be had its samples been integrated at `bias`: its turn alone, spread
/// evenly over the way. The accelerometer's bias moves it by less than a millimetre between two
/// scans.
Odometry at_bias(const Odometry& piece, const InertialBias& bias) {
  Odometry moved = piece;
  if (!piece.inertial || piece.is_standing) return moved;
  const double gyro = bias.x() - piece.inertial->bias.x();
  Eigen::Vector3d twist = piece.from_T_to.Log();
  twist.z() += piece.inertial->bias_jacobian(0, 0) * gyro;
  moved.from_T_to = SE2::Exp(twist);
  moved.inertial = at_bias(*piece.inertial, bias);
  return moved;
}

/// The heading's variance, with what it shares with the way in proportion.
void set_heading_variance(Eigen::Matrix3d& covariance, double variance) {
  const double ratio = covariance(2, 2) > 0.0 ? std::sqrt(variance / covariance(2, 2)) : 0.0;
  covariance.row(2) *= ratio;
  covariance.col(2) *= ratio;
  covariance(2, 2) = variance;
}

}  // namespace

bool OdometryBuffer::add(const Odometry& piece) {
  if (piece.utime <= piece.from_utime) return false;
  if (!pieces_.empty() && piece.from_utime < pieces_.back().utime - kGapTolerance_us) return false;
  pieces_.push_back(bias_ ? at_bias(piece, *bias_) : piece);
  if (velocity_) start_at_velocity(pieces_.back());
  if (pieces_.size() > kMaxPieces) pieces_.pop_front();
  return true;
}

void OdometryBuffer::start_at_velocity(Odometry& piece) {
  if (!piece.inertial || !bias_ || !begins_at(piece, velocity_->utime)) {
    velocity_.reset();
    return;
  }
  const Preintegration inertial = at_bias(*piece.inertial, *bias_);
  if (!piece.is_standing) {
    const SE2WithCovariance motion = way_from(*velocity_, inertial);
    const auto spread = [](const Eigen::Matrix3d& c) { return c(0, 0) + c(1, 1); };
    if (spread(motion.covariance) < spread(piece.covariance)) {
      piece.from_T_to = motion.mean;
      piece.covariance = motion.covariance;
      piece.covariance(2, 2) += inertial.seconds * std::max(inertial.seconds, bias_lasts_s_) *
                                velocity_->gyro_bias_variance;
    }
    if (bias_lasts_s_ == 0.0 && inertial.covariance(0, 0) > 0.0)
      set_heading_variance(piece.covariance, inertial.covariance(0, 0));
  }
  velocity_ = carried_over(*velocity_, piece, inertial);
}

void OdometryBuffer::know(const EkfPose& pose) {
  bias_ = pose.bias;
  KnownVelocity known{pose.utime, pose.velocity_mps, pose.velocity_covariance,
                      pose.bias_covariance(0, 0)};
  // The filter may speak of a time before the latest pieces: it is carried over them.
  auto piece = std::find_if(pieces_.begin(), pieces_.end(), [&](const Odometry& one) {
    return one.utime > known.utime + kGapTolerance_us;
  });
  for (; piece != pieces_.end(); ++piece) {
    if (!piece->inertial || !begins_at(*piece, known.utime)) return;
    known = carried_over(known, *piece, at_bias(*piece->inertial, *bias_));
  }
  velocity_ = known;
}

std::optional<SE2WithCovariance> OdometryBuffer::between(Utime from, Utime to) const {
  if (to < from) return std::nullopt;
  auto piece = std::upper_bound(pieces_.begin(), pieces_.end(), from,
                                [](Utime t, const Odometry& p) { return t < p.utime; });
  SE2WithCovariance motion;
  Utime reached = from;
  while (reached + kGapTolerance_us < to || (reached < to && piece != pieces_.end())) {
    if (piece == pieces_.end() || piece->from_utime > reached + kGapTolerance_us) {
      return std::nullopt;
    }
    const Utime start = std::max(reached, piece->from_utime);
    const Utime end = std::min(to, piece->utime);
    if (end > start) motion = compound(motion, part(*piece, start, end));
    reached = std::max(end, reached + 1);
    ++piece;
  }
  return motion;
}

std::optional<GyroTurn> OdometryBuffer::gyro_turn(Utime from, Utime to) const {
  GyroTurn sum;
  Utime covered = 0;
  for (const Odometry& piece : pieces_) {
    const Utime overlap = std::min(to, piece.utime) - std::max(from, piece.from_utime);
    if (overlap <= 0) continue;
    if (!piece.inertial) return std::nullopt;
    covered += overlap;
    const double part =
        static_cast<double>(overlap) / static_cast<double>(piece.utime - piece.from_utime);
    const double seconds = piece.is_standing ? 0.0 : 1e-6 * static_cast<double>(overlap);
    sum += {part * piece.from_T_to.theta(), part * piece.covariance(2, 2), seconds,
            seconds * piece.inertial->bias.x()};
  }
  if (covered + kGapTolerance_us < to - from) return std::nullopt;
  return sum;
}

void OdometryBuffer::forget_before(Utime utime) {
  while (!pieces_.empty() && pieces_.front().utime <= utime) pieces_.pop_front();
}

}  // namespace understory
