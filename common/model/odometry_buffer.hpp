// Recent odometry, asked for the motion between any two stamps.
#pragma once

#include <deque>
#include <optional>

#include "common/model/odometry.hpp"

namespace understory {

/// Keeps consecutive pieces of odometry. Bounded: old pieces are forgotten.
class OdometryBuffer {
 public:
  explicit OdometryBuffer(std::size_t max_pieces = 20000) : max_pieces_(max_pieces) {}

  /// Adds a piece; one that overlaps or runs backwards is refused (false).
  bool add(const Odometry& piece);
  /// What is known from now on of the gyro's bias (from a filter that sees landmarks): pieces with
  /// an IMU that are added later turn by as much as their own bias differed from it.
  void set_bias(const InertialBias& bias) { bias_ = bias; }
  const std::optional<InertialBias>& bias() const { return bias_; }
  /// Motion of the vehicle from `from` to `to`, or none where a gap or the end of the buffer is in
  /// between. Inside a piece the motion is taken at constant twist and its covariance in proportion
  /// to time.
  std::optional<SE2WithCovariance> between(Utime from, Utime to) const;
  void forget_before(Utime utime);
  const std::deque<Odometry>& pieces() const { return pieces_; }
  /// A piece that pieces() gave, into an empty buffer: as it is.
  void restore(const Odometry& piece) { pieces_.push_back(piece); }

 private:
  std::size_t max_pieces_;
  std::deque<Odometry> pieces_;
  std::optional<InertialBias> bias_;
};

}  // namespace understory
