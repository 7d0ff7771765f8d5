#include "common/model/odometry_buffer.hpp"

#include <algorithm>

namespace understory {
namespace {

/// Pieces from one source may miss each other by rounding of their stamps.
constexpr Utime kGapTolerance_us = 1000;

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
  return moved;
}

}  // namespace

bool OdometryBuffer::add(const Odometry& piece) {
  if (piece.utime <= piece.from_utime) return false;
  if (!pieces_.empty() && piece.from_utime < pieces_.back().utime - kGapTolerance_us) return false;
  pieces_.push_back(bias_ ? at_bias(piece, *bias_) : piece);
  if (pieces_.size() > max_pieces_) pieces_.pop_front();
  return true;
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

void OdometryBuffer::forget_before(Utime utime) {
  while (!pieces_.empty() && pieces_.front().utime <= utime) pieces_.pop_front();
}

}  // namespace understory
