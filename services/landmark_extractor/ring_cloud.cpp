#include "services/landmark_extractor/ring_cloud.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace understory {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kTurn = 2.0F * kPi;
/// Where one return is so much nearer or farther than its neighbour, a ring may be cut.
constexpr float kCut_m = 1.0F;
/// A ring has the slope of a return that is not farther away, whatever the sensor's tilt.
constexpr float kKnownSlope_rad = 0.1F;
/// Above or below the vehicle: nothing on the ground is so far up [m].
constexpr float kHighest_m = 1000.0F;

/// Of a difference between two angles in (-pi, pi].
float wrapped(float angle) {
  if (angle > kPi) return angle - kTurn;
  return angle < -kPi ? angle + kTurn : angle;
}

constexpr std::size_t kBlock = 256;

/// Some points, coordinate by coordinate.
struct Block {
  std::array<float, kBlock> x{};
  std::array<float, kBlock> y{};
  std::array<float, kBlock> z{};
  std::array<float, kBlock> range2{};
  std::array<float, kBlock> range{};
  std::array<float, kBlock> azimuth{};

  void place(std::span<const SweepPoint> points, const Eigen::Matrix3f& rotation,
             const Eigen::Vector3f& sensor, const Eigen::Vector3f& velocity) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const SweepPoint& p = points[i];
      x[i] = rotation(0, 0) * p.x_m + rotation(0, 1) * p.y_m + rotation(0, 2) * p.z_m;
      y[i] = rotation(1, 0) * p.x_m + rotation(1, 1) * p.y_m + rotation(1, 2) * p.z_m;
      z[i] = rotation(2, 0) * p.x_m + rotation(2, 1) * p.y_m + rotation(2, 2) * p.z_m;
      // For a moment: where the sensor was.
      range[i] = sensor.x() + velocity.x() * p.time_s;
      azimuth[i] = sensor.y() + velocity.y() * p.time_s;
    }
    for (std::size_t i = 0; i < kBlock; ++i) {
      const float dx = x[i] - range[i];
      const float dy = y[i] - azimuth[i];
      range2[i] = dx * dx + dy * dy;
      range[i] = std::sqrt(range2[i]);
      azimuth[i] = fast_atan2(dy, dx);
    }
  }
};

}  // namespace

void RingCloud::fill(const PointSweep& sweep, double min_range_m, double max_range_m,
                     PointCounters& counters) {
  reserve_rings(sweep, counters);
  scatter(sweep, min_range_m, max_range_m, counters);
  begins_.assign(sweep.rings + std::size_t{1}, 0);
  for (std::size_t ring = 0; ring < sweep.rings; ++ring) {
    begins_[ring + 1] = begins_[ring] + (next_[ring] - slots_[ring]);
  }
  points_.resize(begins_.back());
  steps_.assign(sweep.rings, 0.0F);
  for (std::size_t ring = 0; ring < sweep.rings; ++ring) {
    order_ring(ring);
    measure_step(ring);
  }
}

void RingCloud::reserve_rings(const PointSweep& sweep, PointCounters& counters) {
  slots_.assign(sweep.rings + std::size_t{1}, 0);
  for (const SweepPoint& point : sweep.points) {
    if (point.ring < sweep.rings) {
      ++slots_[point.ring + std::size_t{1}];
    } else {
      ++counters.bad_ring;
    }
  }
  for (std::size_t ring = 0; ring < sweep.rings; ++ring) slots_[ring + 1] += slots_[ring];
  next_.assign(slots_.begin(), slots_.end() - 1);
  scattered_.resize(slots_.back());
}

void RingCloud::scatter(const PointSweep& sweep, double min_range_m, double max_range_m,
                        PointCounters& counters) {
  const Eigen::Matrix3f level_R_vehicle =
      sweep.attitude
          ? Eigen::Matrix3f(sweep.attitude->level_Q_vehicle.toRotationMatrix().cast<float>())
          : Eigen::Matrix3f(Eigen::Matrix3f::Identity());
  level_R_vehicle_ = level_R_vehicle;
  sensor_ = level_R_vehicle * sweep.sensor_position_m.cast<float>();
  counts_.clear();
  for (std::size_t ring = 0; ring < sweep.rings; ++ring) {
    counts_.push_back(slots_[ring + 1] - slots_[ring]);
  }
  spin_ = fit_spin(sweep, max_range_m, counts_);
  level_velocity_ =
      level_R_vehicle * Eigen::Vector3f(spin_.velocity_mps.x(), spin_.velocity_mps.y(), 0.0F);
  // In blocks, so that the compiler computes several points at once.
  const auto nearest2 = static_cast<float>(min_range_m * min_range_m);
  const auto farthest2 = static_cast<float>(max_range_m * max_range_m);
  Block block;
  for (std::size_t first = 0; first < sweep.points.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, sweep.points.size() - first);
    const std::span points(sweep.points.data() + first, count);
    block.place(points, level_R_vehicle, sensor_, level_velocity_);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint16_t ring = points[i].ring;
      if (ring >= sweep.rings) continue;
      const float range2 = block.range2[i];
      // A coordinate that is no number makes all of them none.
      if (!(range2 >= nearest2 && range2 <= farthest2 && std::abs(block.z[i]) < kHighest_m)) {
        if (!points[i].position().allFinite()) ++counters.not_finite;
        continue;
      }
      scattered_[next_[ring]++] = {block.x[i],     block.y[i], block.z[i],      block.azimuth[i],
                                   block.range[i], 0.0F,       points[i].time_s};
    }
  }
}

/// Copies a ring so that its azimuth grows and no object lies on both of its ends.
void RingCloud::order_ring(std::size_t ring) {
  const RingPoint* from = scattered_.data() + slots_[ring];
  const std::size_t count = next_[ring] - slots_[ring];
  std::ptrdiff_t leftward = 0;
  for (std::size_t i = 1; i < count; i += 7) {
    leftward += wrapped(from[i].azimuth_rad - from[i - 1].azimuth_rad) > 0.0F ? 1 : -1;
  }
  std::size_t cut = 0;
  for (std::size_t i = 1; i < count && cut == 0; ++i) {
    if (std::abs(from[i].range_m - from[i - 1].range_m) > kCut_m) cut = i;
  }
  RingPoint* to = points_.data() + begins_[ring];
  const auto copy = [&](std::size_t k, std::size_t i) {
    to[k] = from[i];
    if (k == 0) return;
    const float previous = to[k - 1].azimuth_rad;
    float change = from[i].azimuth_rad - previous;
    while (change < -kPi) change += kTurn;
    to[k].azimuth_rad = previous + wrapped(change);
  };
  std::size_t k = 0;
  if (leftward >= 0) {
    for (std::size_t i = cut; i < count; ++i) copy(k++, i);
    for (std::size_t i = 0; i < cut; ++i) copy(k++, i);
  } else {
    for (std::size_t i = cut; i-- > 0;) copy(k++, i);
    for (std::size_t i = count; i-- > cut;) copy(k++, i);
  }
}

void RingCloud::measure_step(std::size_t ring) {
  differences_.clear();
  for (std::size_t i = begins_[ring] + 1; i < begins_[ring + 1]; i += 4) {
    const float difference = points_[i].azimuth_rad - points_[i - 1].azimuth_rad;
    if (difference > 1e-5F) differences_.push_back(difference);
  }
  if (differences_.empty()) return;
  const auto middle = differences_.begin() + static_cast<std::ptrdiff_t>(differences_.size() / 2);
  std::nth_element(differences_.begin(), middle, differences_.end());
  steps_[ring] = *middle;
}

std::size_t RingCloud::first_at(std::size_t ring, float azimuth_rad) const {
  const std::size_t begin = begins_[ring];
  const std::size_t end = begins_[ring + 1];
  if (begin == end) return end;
  const float start = points_[begin].azimuth_rad;
  float beyond = azimuth_rad - start;
  while (beyond < 0.0F) beyond += kTurn;
  while (beyond >= kTurn) beyond -= kTurn;
  const float azimuth = start + beyond;
  const auto it = std::lower_bound(
      points_.begin() + static_cast<std::ptrdiff_t>(begin),
      points_.begin() + static_cast<std::ptrdiff_t>(end), azimuth,
      [](const RingPoint& point, float value) { return point.azimuth_rad < value; });
  return static_cast<std::size_t>(it - points_.begin());
}

float RingCloud::slope(std::size_t ring, float azimuth_rad) const {
  const RingPoint* near = &points_[std::min(first_at(ring, azimuth_rad), begins_[ring + 1] - 1)];
  if (std::abs(std::remainder(near->azimuth_rad - azimuth_rad, kTurn)) < kKnownSlope_rad) {
    return (near->z_m - sensor_.z()) / near->range_m;
  }
  return rough_slope(ring, azimuth_rad);
}

float RingCloud::rough_slope(std::size_t ring, float azimuth_rad) const {
  const Eigen::Vector3f level(std::cos(azimuth_rad), std::sin(azimuth_rad), 0.0F);
  Eigen::Vector3f beam = level_R_vehicle_.transpose() * level;
  beam.z() = spin_.slopes[ring] * std::hypot(beam.x(), beam.y());
  beam = level_R_vehicle_ * beam;
  return beam.z() / std::hypot(beam.x(), beam.y());
}

}  // namespace understory
