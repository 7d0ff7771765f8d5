// How the sensor moved while it turned, from the points of the turn alone.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "common/model/point_sweep.hpp"

namespace understory {

/// What a turn's points say of the sensor, in the frame of the points.
struct Spin {
  /// Of the sensor in the plan; zero where the times are unknown or do not fit.
  Eigen::Vector2f velocity_mps = Eigen::Vector2f::Zero();
  std::vector<float> slopes;  ///< Per ring: rise of its beams per metre of range; NaN = no points.
};

/// A sensor turns evenly: the azimuth of its beams grows linearly with time, each ring from an
/// offset of its own. A de-skewed point at time t was seen from `velocity * t` away, which turns
/// its azimuth by parallax; the velocity is what leaves beams that turn evenly (least squares on a
/// part of the points). `points_per_ring` counts the points of each ring.
Spin fit_spin(const PointSweep& sweep, double max_range_m,
              std::span<const std::size_t> points_per_ring);

/// atan2 to 1e-5 rad without a branch on the data (polynomial of least maximum error).
inline float fast_atan2(float y, float x) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float large = std::max(std::max(ax, ay), 1e-20F);
  const float q = std::min(ax, ay) / large;
  const float s = q * q;
  float angle =
      q * (0.99997726F +
           s * (-0.33262347F +
                s * (0.19354346F + s * (-0.11643287F + s * (0.05265332F - s * 0.01172120F)))));
  angle = ay > ax ? 0.5F * kPi - angle : angle;
  angle = x < 0.0F ? kPi - angle : angle;
  return y < 0.0F ? -angle : angle;
}

}  // namespace understory
