#include "services/landmark_extractor/rings/ring_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory::landmark_extractor::rings {
namespace {

constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
/// A ring's slope is taken from a return within this azimuth, whatever the sensor's tilt.
constexpr float kKnownSlope_rad = 0.1F;

/// Number of steps from beam to beam for their median, and how many of them are adjacent.
constexpr std::size_t kSteps = 40;
constexpr std::size_t kTogether = 4;
/// Number of points for the slope of a ring.
constexpr std::size_t kSlopes = 16;

}  // namespace

const points::Levelling& RingCloud::look_at(const model::PointSweep& sweep, double min_range_m,
                                            double max_range_m) {
  levelling_.level_R_vehicle =
      sweep.attitude
          ? Eigen::Matrix3f(sweep.attitude->level_Q_vehicle.toRotationMatrix().cast<float>())
          : Eigen::Matrix3f(Eigen::Matrix3f::Identity());
  levelling_.sensor_m = levelling_.level_R_vehicle * sweep.sensor_position_m.cast<float>();
  levelling_.min_range_m = static_cast<float>(min_range_m);
  levelling_.max_range_m = static_cast<float>(max_range_m);
  spin_fitter_.fit(sweep, max_range_m, spin_);
  levelling_.velocity_mps = levelling_.level_R_vehicle *
                            Eigen::Vector3f(spin_.velocity_mps.x(), spin_.velocity_mps.y(), 0.0F);
  return levelling_;
}

void RingCloud::fill(const model::PointSweep& sweep, const ground::GroundSurface& ground,
                     PointCounters& counters) {
  slots_.fill(sweep, levelling_, spin_.is_leftward, ground, counters);
  rings_.assign(sweep.rings, {});
  slopes_.assign(sweep.rings, std::numeric_limits<float>::quiet_NaN());
}

void RingCloud::order(std::size_t ring, float lowest_m) {
  const IndexRange range = slots_.cut(ring, lowest_m);
  rings_[ring].begin = range.begin;
  rings_[ring].end = range.end;
  measure_step(rings_[ring]);
  measure_slope(ring);
}

/// The median of some differences; adjacent points are the fastest to read.
void RingCloud::measure_step(Ring& ring) {
  const std::span points = slots_.points();
  differences_.clear();
  const std::size_t size = ring.end - ring.begin;
  const std::size_t stride = std::max(kTogether, size * kTogether / kSteps);
  for (std::size_t first = ring.begin; first < ring.end; first += stride) {
    const std::size_t last = std::min(first + kTogether, ring.end - 1);
    for (std::size_t i = first; i < last; ++i) {
      const float difference = points[i + 1].azimuth_rad - points[i].azimuth_rad;
      if (difference > 1e-5F) differences_.push_back(difference);
    }
  }
  if (differences_.empty()) return;
  const auto middle = differences_.begin() + static_cast<std::ptrdiff_t>(differences_.size() / 2);
  std::nth_element(differences_.begin(), middle, differences_.end());
  ring.step_rad = *middle;
}

/// The mean of some of its points.
void RingCloud::measure_slope(std::size_t ring) {
  const std::span points = slots_.points();
  const std::size_t begin = rings_[ring].begin;
  const std::size_t end = rings_[ring].end;
  const Eigen::Matrix3f vehicle_R_level = levelling_.level_R_vehicle.transpose();
  const std::size_t stride = (end - begin) / kSlopes + 1;
  float sum = 0.0F;
  float count = 0.0F;
  for (std::size_t i = begin; i < end; i += stride) {
    const points::RingPoint& point = points[i];
    const Eigen::Vector3f beam =
        vehicle_R_level * (Eigen::Vector3f(point.x_m, point.y_m, point.z_m) - levelling_.sensor_m -
                           point.time_s * levelling_.velocity_mps);
    sum += beam.z() / beam.head<2>().norm();
    count += 1.0F;
  }
  if (count > 0.0F) slopes_[ring] = sum / count;
}

std::size_t RingCloud::first_at(std::size_t ring, float azimuth_rad) const {
  const std::size_t begin = rings_[ring].begin;
  const std::size_t end = rings_[ring].end;
  if (begin == end) return end;

  const points::RingPoint* const points = slots_.points().data();
  const float start = points[begin].azimuth_rad;
  float beyond = azimuth_rad - start;
  while (beyond < 0.0F) beyond += kTurn;
  while (beyond >= kTurn) beyond -= kTurn;
  const float azimuth = start + beyond;

  // Beams without a return make the index smaller than constant steps would.
  const float step = rings_[ring].step_rad;
  const auto guess = step > 0.0F ? static_cast<std::size_t>(beyond / step) : 0;
  std::size_t high = std::min(end, begin + guess + 1);
  std::size_t low = high;
  const auto is_before = [&](std::size_t i) { return points[i].azimuth_rad < azimuth; };
  if (high < end && is_before(high)) {
    high = end;
  } else {
    for (std::size_t width = 1; low > begin && !is_before(low - 1); width *= 2) {
      high = low - 1;
      low -= std::min(low - begin, width);
    }
  }

  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (is_before(middle)) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

float RingCloud::slope(std::size_t ring, const points::RingPoint& near, float azimuth_rad) const {
  if (std::abs(points::wrap_angle_f(near.azimuth_rad - azimuth_rad)) < kKnownSlope_rad) {
    return (near.z_m - sensor_m().z()) / near.range_m;
  }
  return rough_slopes({std::cos(azimuth_rad), std::sin(azimuth_rad)})(ring);
}

}  // namespace understory::landmark_extractor::rings
