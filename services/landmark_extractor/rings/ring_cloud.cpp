#include "services/landmark_extractor/rings/ring_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory::landmark_extractor::rings {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kTurn = 2.0F * kPi;
/// Where one return is so much nearer or farther than its neighbour, a ring may be cut.
constexpr float kCut_m = 1.0F;
/// A ring has the slope of a return that is not farther away, whatever the sensor's tilt.
constexpr float kKnownSlope_rad = 0.1F;

/// So many steps from beam to beam tell their median; so many of them lie together.
constexpr std::size_t kSteps = 40;
constexpr std::size_t kTogether = 4;
/// So many points tell the slope of a ring.
constexpr std::size_t kSlopes = 16;
/// So many points ahead memory is asked for.
constexpr std::ptrdiff_t kAhead = 4;

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
  std::size_t points_per_ring = sweep.points.size() / sweep.rings;
  PointCounters of_this;
  do {
    points_per_ring += points_per_ring / 4 + 1;
    reserve_slots(sweep.rings, points_per_ring);
    of_this = {};
  } while (!scatter(sweep, ground, of_this));
  counters.not_finite += of_this.not_finite;
  counters.bad_ring += of_this.bad_ring;
  steps_.assign(sweep.rings, 0.0F);
  slopes_.assign(sweep.rings, std::numeric_limits<float>::quiet_NaN());
}

void RingCloud::order(std::size_t ring, float lowest_m) {
  cut_ring(ring, lowest_m);
  measure_step(ring);
  measure_slope(ring);
}

void RingCloud::reserve_slots(std::size_t rings, std::size_t points_per_ring) {
  if (slot_ < 2 * points_per_ring) {
    // Half as much again, so that sweeps which grow little by little seldom ask for more; an odd
    // number of cache lines, so that the rings' ends do not crowd into a few of the sets.
    constexpr std::size_t kUnit = 2;
    slot_ = (3 * points_per_ring / kUnit | 1U) * kUnit;
  }
  if (capacity_ < rings * slot_) {
    points_.reset();
    capacity_ = rings * slot_;
    points_ = std::make_unique_for_overwrite<points::RingPoint[]>(capacity_);
  }
  filling_.resize(rings);
  begins_.resize(rings);
  ends_.resize(rings);
  const auto most = static_cast<std::ptrdiff_t>(slot_ / 2);
  for (std::size_t ring = 0; ring < rings; ++ring) {
    // A ring that turns to the right fills its slot from behind: azimuth grows either way.
    points::RingPoint* first = points_.get() + ring * slot_ + (spin_.is_leftward ? 0 : slot_ - 1);
    filling_[ring] = {first, spin_.is_leftward ? first + most : first - most,
                      std::numeric_limits<float>::quiet_NaN(), 0.0F};
  }
}

bool RingCloud::scatter(const model::PointSweep& sweep, const ground::GroundSurface& ground,
                        PointCounters& counters) {
  // Copies, which no write to a point can change.
  const std::ptrdiff_t forward = spin_.is_leftward ? 1 : -1;
  const std::uint16_t rings = sweep.rings;
  Filling* const filling = filling_.data();
  points::PointBlock& block = block_;
  for (std::size_t first = 0; first < sweep.points.size(); first += points::PointBlock::kSize) {
    const std::size_t count = std::min(points::PointBlock::kSize, sweep.points.size() - first);
    const model::SweepPoint* const points = sweep.points.data() + first;
    place_block({points, count}, levelling_, ground.grid(), ground.patches(), block);
    for (std::size_t i = 0; i < count; ++i) {
      const points::RingPoint point = block.points[i];
      const std::uint16_t ring = points[i].ring;
      if (point.is_in_range == 0.0F || ring >= rings) {
        if (ring >= rings) {
          ++counters.bad_ring;
        } else if (!points[i].position().allFinite()) {
          ++counters.not_finite;
        }
        continue;
      }
      Filling& here = filling[ring];
      points::RingPoint* const place = here.next;
      if (place == here.full) return false;
      float azimuth = point.azimuth_rad + here.turned_rad;
      const float change = azimuth - here.azimuth_rad;
      if (std::abs(change) > kPi) {
        const float turn = change > 0.0F ? -kTurn : kTurn;
        here.turned_rad += turn;
        azimuth += turn;
      }
      here.azimuth_rad = azimuth;
      here.next = place + forward;
      *place = point;
      place->azimuth_rad = azimuth;
      // As many streams as there are rings are more than the processor foresees by itself.
      __builtin_prefetch(place + kAhead * forward, 1);
    }
  }
  return true;
}

/// Moves the ring's first points behind its last so that no object lies on both of its ends.
void RingCloud::cut_ring(std::size_t ring, float lowest_m) {
  const points::RingPoint* const slot = points_.get() + ring * slot_;
  const points::RingPoint* const next = filling_[ring].next;
  const auto count =
      static_cast<std::size_t>(spin_.is_leftward ? next - slot : slot + slot_ - 1 - next);
  std::size_t& begin = begins_[ring];
  std::size_t& end = ends_[ring];
  begin = spin_.is_leftward ? ring * slot_ : (ring + 1) * slot_ - count;
  end = begin + count;
  const auto parts = [&](std::size_t a, std::size_t b) {
    return points_[a].height_m <= lowest_m ||
           std::abs(points_[a].range_m - points_[b].range_m) > kCut_m;
  };
  std::size_t cut = 1;
  if (spin_.is_leftward) {
    while (cut < count && !parts(begin + cut, begin + cut - 1)) ++cut;
  } else {
    while (cut < count && !parts(end - 1 - cut, end - cut)) ++cut;
  }
  if (cut >= count) return;
  const std::size_t from = spin_.is_leftward ? begin : end - cut;
  const std::size_t to = spin_.is_leftward ? end : begin - cut;
  // Ascends by less than half a turn where the ends meet.
  const float ascent = spin_.is_leftward
                           ? points_[from].azimuth_rad - points_[end - 1].azimuth_rad
                           : points_[begin].azimuth_rad - points_[end - 1].azimuth_rad;
  const float turn = kTurn * std::round(ascent / kTurn) * (spin_.is_leftward ? -1.0F : 1.0F);
  for (std::size_t i = 0; i < cut; ++i) {
    points_[to + i] = points_[from + i];
    points_[to + i].azimuth_rad += turn;
  }
  begin = spin_.is_leftward ? begin + cut : begin - cut;
  end = spin_.is_leftward ? end + cut : end - cut;
}

/// The median of some differences; neighbours side by side cost the least time to look at.
void RingCloud::measure_step(std::size_t ring) {
  differences_.clear();
  const std::size_t size = ends_[ring] - begins_[ring];
  const std::size_t stride = std::max(kTogether, size * kTogether / kSteps);
  for (std::size_t first = begins_[ring]; first < ends_[ring]; first += stride) {
    const std::size_t last = std::min(first + kTogether, ends_[ring] - 1);
    for (std::size_t i = first; i < last; ++i) {
      const float difference = points_[i + 1].azimuth_rad - points_[i].azimuth_rad;
      if (difference > 1e-5F) differences_.push_back(difference);
    }
  }
  if (differences_.empty()) return;
  const auto middle = differences_.begin() + static_cast<std::ptrdiff_t>(differences_.size() / 2);
  std::nth_element(differences_.begin(), middle, differences_.end());
  steps_[ring] = *middle;
}

/// The mean of some of its points.
void RingCloud::measure_slope(std::size_t ring) {
  const Eigen::Matrix3f vehicle_R_level = levelling_.level_R_vehicle.transpose();
  const std::size_t stride = (ends_[ring] - begins_[ring]) / kSlopes + 1;
  float sum = 0.0F;
  float count = 0.0F;
  for (std::size_t i = begins_[ring]; i < ends_[ring]; i += stride) {
    const points::RingPoint& point = points_[i];
    const Eigen::Vector3f beam =
        vehicle_R_level * (Eigen::Vector3f(point.x_m, point.y_m, point.z_m) - levelling_.sensor_m -
                           point.time_s * levelling_.velocity_mps);
    sum += beam.z() / beam.head<2>().norm();
    count += 1.0F;
  }
  if (count > 0.0F) slopes_[ring] = sum / count;
}

std::size_t RingCloud::first_at(std::size_t ring, float azimuth_rad) const {
  const std::size_t begin = begins_[ring];
  const std::size_t end = ends_[ring];
  if (begin == end) return end;
  const float start = points_[begin].azimuth_rad;
  float beyond = azimuth_rad - start;
  while (beyond < 0.0F) beyond += kTurn;
  while (beyond >= kTurn) beyond -= kTurn;
  const float azimuth = start + beyond;
  // Beams without a return make it come sooner than even steps would.
  const auto guess = steps_[ring] > 0.0F ? static_cast<std::size_t>(beyond / steps_[ring]) : 0;
  std::size_t high = std::min(end, begin + guess + 1);
  std::size_t low = high;
  const auto is_before = [&](std::size_t i) { return points_[i].azimuth_rad < azimuth; };
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
