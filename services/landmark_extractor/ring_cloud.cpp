#include "services/landmark_extractor/ring_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kTurn = 2.0F * kPi;
/// Where one return is so much nearer or farther than its neighbour, a ring may be cut.
constexpr float kCut_m = 1.0F;

/// atan2 to 1e-5 rad without a branch on the data (polynomial of least maximum error).
float fast_atan2(float y, float x) {
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

float wrapped(float angle) { return angle - kTurn * std::floor(angle / kTurn + 0.5F); }

}  // namespace

Eigen::Vector2d RingPoint::origin() const {
  const double azimuth = azimuth_rad;
  return position() -
         static_cast<double>(range_m) * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth));
}

void RingCloud::fill(const PointSweep& sweep, double min_range_m, double max_range_m,
                     PointCounters& counters) {
  const Eigen::Matrix3f level_R_vehicle =
      sweep.attitude
          ? Eigen::Matrix3f(sweep.attitude->level_Q_vehicle.toRotationMatrix().cast<float>())
          : Eigen::Matrix3f(Eigen::Matrix3f::Identity());
  sensor_ = level_R_vehicle * sweep.sensor_position_m.cast<float>();
  steps_.assign(sweep.rings, 0.0F);
  begins_.assign(sweep.rings + std::size_t{1}, 0);
  kept_.clear();
  kept_rings_.clear();
  const auto nearest2 = static_cast<float>(min_range_m * min_range_m);
  const auto farthest2 = static_cast<float>(max_range_m * max_range_m);
  for (const SweepPoint& point : sweep.points) {
    const Eigen::Vector3f p = level_R_vehicle * point.position();
    const float x = p.x() - sensor_.x();
    const float y = p.y() - sensor_.y();
    const float range2 = x * x + y * y;
    if (!(range2 >= nearest2 && range2 <= farthest2) || !std::isfinite(p.z())) {
      if (!p.allFinite()) ++counters.not_finite;
      continue;
    }
    if (point.ring >= sweep.rings) {
      ++counters.bad_ring;
      continue;
    }
    kept_.push_back({p.x(), p.y(), p.z(), fast_atan2(y, x), std::sqrt(range2), 0.0F});
    kept_rings_.push_back(point.ring);
    ++begins_[point.ring + std::size_t{1}];
  }
  sort_into_rings(sweep);
}

void RingCloud::sort_into_rings(const PointSweep& sweep) {
  for (std::size_t ring = 0; ring < sweep.rings; ++ring) begins_[ring + 1] += begins_[ring];
  points_.resize(kept_.size());
  std::vector<std::size_t>& next = begins_;  // Shifted by one ring while it is used as a cursor.
  for (std::size_t i = 0; i < kept_.size(); ++i) points_[next[kept_rings_[i]]++] = kept_[i];
  for (std::size_t ring = sweep.rings; ring > 0; --ring) begins_[ring] = begins_[ring - 1];
  begins_[0] = 0;
  for (std::size_t ring = 0; ring < sweep.rings; ++ring) order_ring(ring);
}

void RingCloud::order_ring(std::size_t ring) {
  const auto first = points_.begin() + static_cast<std::ptrdiff_t>(begins_[ring]);
  const auto last = points_.begin() + static_cast<std::ptrdiff_t>(begins_[ring + 1]);
  if (last - first < 3) return;
  std::ptrdiff_t leftward = 0;
  for (auto it = first + 1; it < last; it += 7) {
    leftward += wrapped(it->azimuth_rad - (it - 1)->azimuth_rad) > 0.0F ? 1 : -1;
  }
  if (leftward < 0) std::reverse(first, last);
  // No object should lie on both ends of the array: it begins where the range jumps.
  const auto cut = std::adjacent_find(first, last, [](const RingPoint& a, const RingPoint& b) {
    return std::abs(a.range_m - b.range_m) > kCut_m;
  });
  if (cut != last) std::rotate(first, cut + 1, last);
  for (auto it = first + 1; it < last; ++it) {
    it->azimuth_rad = (it - 1)->azimuth_rad + wrapped(it->azimuth_rad - (it - 1)->azimuth_rad);
  }
  measure_step(ring);
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
  const float beyond = azimuth_rad - start;
  const float azimuth = start + (beyond - kTurn * std::floor(beyond / kTurn));
  const auto it = std::lower_bound(
      points_.begin() + static_cast<std::ptrdiff_t>(begin),
      points_.begin() + static_cast<std::ptrdiff_t>(end), azimuth,
      [](const RingPoint& point, float value) { return point.azimuth_rad < value; });
  return static_cast<std::size_t>(it - points_.begin());
}

}  // namespace understory
