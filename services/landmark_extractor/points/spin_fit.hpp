// Motion of the sensor during a revolution, from the points of the sweep alone.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "common/model/point_sweep.hpp"

namespace understory::landmark_extractor::points {

/// Motion of the sensor, in the frame of the points.
struct Spin {
  /// Of the sensor in the plan; zero if the times are unknown or do not fit.
  Eigen::Vector2f velocity_mps = Eigen::Vector2f::Zero();
  float rate_radps = 0.0F;  ///< Left positive; 0 = unknown.
  bool is_leftward = true;  ///< Direction of the rotation, seen from above.
};

/// A sensor rotates at a constant rate: the azimuth of its beams grows linearly with time, each
/// ring with its own offset. A de-skewed point at time t was seen from `velocity * t` away, which
/// changes its azimuth by parallax; the velocity is estimated such that the beams rotate at a
/// constant rate (least squares on a part of the points). Reuses memory between sweeps, but has no
/// state.
class SpinFitter {
 public:
  /// Sets the spin from points within `max_range_m`. The velocity is zero and the rate unknown if
  /// the sweep has no times, or the rotation of the beams is not constant to 0.01 rad.
  void fit(const model::PointSweep& sweep, double max_range_m, Spin& spin);

 private:
  /// One point as seen from the sensor's position at utime.
  struct Sample {
    float x;
    float y;
    float time_s;
    std::uint16_t ring;
  };
  /// One sample linearised: time, d azimuth / d velocity, azimuth without the spin.
  struct Row {
    float time_s;
    float by_x;
    float by_y;
    float turned;
  };
  /// Sums over the samples of one ring.
  struct Means {
    double count = 0.0;
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();  ///< Of (t, d azimuth / d velocity, residual).
    float offset = 0.0F;                            ///< Whether another iteration is needed.
    std::size_t samples = 0;
  };

  void take_samples(const model::PointSweep& sweep, double max_range_m);
  float look_at_neighbours(const model::PointSweep& sweep, std::uint16_t ring, Spin& spin);
  /// Whether there is more to improve.
  bool improve();

  std::vector<Sample> samples_;
  std::vector<Row> rows_;
  std::vector<Means> means_;  ///< Per ring.
  std::vector<float> rates_;
  double rate_ = 0.0;  ///< [rad/s]
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();
  double residual_rms_ = 0.0;
};

/// The same angle between -pi and pi [rad], for few turns.
inline float wrap_angle_f(float angle_rad) {
  constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  const float turns = angle_rad * (1.0F / kTurn);
  return angle_rad -
         kTurn * static_cast<float>(static_cast<int>(turns + (turns < 0 ? -0.5F : 0.5F)));
}

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

}  // namespace understory::landmark_extractor::points
