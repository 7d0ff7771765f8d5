#include "services/landmark_extractor/ring_cloud.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

/// So many steps from beam to beam tell their median.
constexpr std::size_t kSteps = 128;
/// So many points ahead memory is asked for.
constexpr std::ptrdiff_t kAhead = 4;

constexpr std::size_t kBlock = 256;

/// Some points, coordinate by coordinate.
struct Block {
  std::array<float, kBlock> x{};
  std::array<float, kBlock> y{};
  std::array<float, kBlock> z{};
  std::array<float, kBlock> range2{};
  std::array<float, kBlock> range{};
  std::array<float, kBlock> azimuth{};

  std::array<std::uint32_t, kBlock> cell{};
};

/// What turns points of a sweep into those of a cloud.
struct Placing {
  Eigen::Matrix3f rotation;
  Eigen::Vector3f sensor;
  Eigen::Vector3f velocity;
  float corner_x_m;
  float corner_y_m;
  float last_cell;
  float cells_per_side;
};

[[gnu::always_inline]] inline void place_all(std::span<const SweepPoint> points,
                                             const Placing& placing, Block& block) {
  // Coordinate by coordinate first; range holds the time for a moment.
  for (std::size_t i = 0; i < points.size(); ++i) {
    block.x[i] = points[i].x_m;
    block.y[i] = points[i].y_m;
    block.z[i] = points[i].z_m;
    block.range[i] = points[i].time_s;
  }
  // A copy, which no write to the block can change.
  const Placing by = placing;
  const Eigen::Matrix3f& turn = by.rotation;
  for (std::size_t i = 0; i < kBlock; ++i) {
    const float x = turn(0, 0) * block.x[i] + turn(0, 1) * block.y[i] + turn(0, 2) * block.z[i];
    const float y = turn(1, 0) * block.x[i] + turn(1, 1) * block.y[i] + turn(1, 2) * block.z[i];
    const float z = turn(2, 0) * block.x[i] + turn(2, 1) * block.y[i] + turn(2, 2) * block.z[i];
    const float dx = x - (by.sensor.x() + by.velocity.x() * block.range[i]);
    const float dy = y - (by.sensor.y() + by.velocity.y() * block.range[i]);
    block.x[i] = x;
    block.y[i] = y;
    block.z[i] = z;
    block.range2[i] = dx * dx + dy * dy;
    block.range[i] = std::sqrt(block.range2[i]);
    block.azimuth[i] = fast_atan2(dy, dx);
  }
  static_assert(LowestCells::kCell_m == 1.0F);
  for (std::size_t i = 0; i < kBlock; ++i) {
    // A number that is none becomes cell 0.
    const float u = std::min(std::max(0.0F, block.x[i] - by.corner_x_m), by.last_cell);
    const float v = std::min(std::max(0.0F, block.y[i] - by.corner_y_m), by.last_cell);
    const auto row = static_cast<float>(static_cast<int>(v));
    block.cell[i] = static_cast<std::uint32_t>(
        static_cast<int>(row * by.cells_per_side + static_cast<float>(static_cast<int>(u))));
  }
}

#if defined(__x86_64__)
// Without fused multiplication: the same numbers on every machine.
[[gnu::target("avx2")]] void place_with_avx2(std::span<const SweepPoint> points,
                                             const Placing& placing, Block& block) {
  place_all(points, placing, block);
}
#endif

void place(std::span<const SweepPoint> points, const Placing& placing, Block& block) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return place_with_avx2(points, placing, block);
#endif
  place_all(points, placing, block);
}

}  // namespace

void RingCloud::fill(const PointSweep& sweep, double min_range_m, double max_range_m,
                     PointCounters& counters) {
  level_R_vehicle_ =
      sweep.attitude
          ? Eigen::Matrix3f(sweep.attitude->level_Q_vehicle.toRotationMatrix().cast<float>())
          : Eigen::Matrix3f(Eigen::Matrix3f::Identity());
  sensor_ = level_R_vehicle_ * sweep.sensor_position_m.cast<float>();
  spin_fitter_.fit(sweep, max_range_m, spin_);
  level_velocity_ =
      level_R_vehicle_ * Eigen::Vector3f(spin_.velocity_mps.x(), spin_.velocity_mps.y(), 0.0F);
  std::size_t points_per_ring = sweep.points.size() / sweep.rings;
  PointCounters of_this;
  do {
    points_per_ring += points_per_ring / 4 + 1;
    reserve_slots(sweep.rings, points_per_ring);
    lowest_.clear(sensor_.x(), sensor_.y(), static_cast<float>(max_range_m));
    of_this = {};
  } while (!scatter(sweep, min_range_m, max_range_m, of_this));
  counters.not_finite += of_this.not_finite;
  counters.bad_ring += of_this.bad_ring;
  steps_.assign(sweep.rings, 0.0F);
}

void RingCloud::order(std::size_t ring) {
  cut_ring(ring);
  measure_step(ring);
}

void RingCloud::reserve_slots(std::size_t rings, std::size_t points_per_ring) {
  // An odd number of cache lines, so that the rings' ends do not crowd into a few of the sets.
  constexpr std::size_t kUnit = 16;
  const std::size_t units = 2 * points_per_ring / kUnit + 1;
  slot_ = std::max(slot_, (units | 1U) * kUnit);
  if (points_.size() < rings * slot_) points_.resize(rings * slot_);
  filling_.resize(rings);
  begins_.resize(rings);
  ends_.resize(rings);
  for (std::size_t ring = 0; ring < rings; ++ring) {
    // A ring that turns to the right fills its slot from behind: azimuth grows either way.
    RingPoint* slot = points_.data() + ring * slot_;
    filling_[ring] = {spin_.is_leftward ? slot : slot + slot_ - 1, 0,
                      std::numeric_limits<float>::quiet_NaN(), 0.0F};
  }
}

bool RingCloud::scatter(const PointSweep& sweep, double min_range_m, double max_range_m,
                        PointCounters& counters) {
  // In blocks, so that the compiler computes several points at once.
  const auto nearest2 = static_cast<float>(min_range_m * min_range_m);
  const auto farthest2 = static_cast<float>(max_range_m * max_range_m);
  const std::ptrdiff_t forward = spin_.is_leftward ? 1 : -1;
  const std::size_t most = slot_ / 2;
  const auto side = static_cast<float>(lowest_.side);
  const Placing placing{
      level_R_vehicle_, sensor_, level_velocity_, lowest_.corner_x_m, lowest_.corner_y_m,
      side - 1.0F,      side};
  Block block;
  for (std::size_t first = 0; first < sweep.points.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, sweep.points.size() - first);
    const std::span points(sweep.points.data() + first, count);
    place(points, placing, block);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint16_t ring = points[i].ring;
      if (ring >= sweep.rings) {
        ++counters.bad_ring;
        continue;
      }
      const float range2 = block.range2[i];
      // A coordinate that is no number makes all of them none.
      if (!(range2 >= nearest2 && range2 <= farthest2 && std::abs(block.z[i]) < kHighest_m)) {
        if (!points[i].position().allFinite()) ++counters.not_finite;
        continue;
      }
      float& lowest = lowest_.lowest_m[block.cell[i]];
      lowest = std::min(lowest, block.z[i]);
      Filling& filling = filling_[ring];
      if (++filling.count > most) return false;
      float azimuth = block.azimuth[i] + filling.turned_rad;
      const float change = azimuth - filling.azimuth_rad;
      if (std::abs(change) > kPi) {
        const float turn = change > 0.0F ? -kTurn : kTurn;
        filling.turned_rad += turn;
        azimuth += turn;
      }
      filling.azimuth_rad = azimuth;
      *filling.next = {block.x[i],     block.y[i], block.z[i],      azimuth,
                       block.range[i], 0.0F,       points[i].time_s};
      filling.next += forward;
      // As many streams as there are rings are more than the processor foresees by itself.
      __builtin_prefetch(filling.next + kAhead * forward, 1);
    }
  }
  return true;
}

/// Moves the ring's first points behind its last so that no object lies on both of its ends.
void RingCloud::cut_ring(std::size_t ring) {
  const std::size_t count = filling_[ring].count;
  std::size_t& begin = begins_[ring];
  std::size_t& end = ends_[ring];
  begin = spin_.is_leftward ? ring * slot_ : (ring + 1) * slot_ - count;
  end = begin + count;
  const auto jumps = [&](std::size_t a, std::size_t b) {
    return std::abs(points_[a].range_m - points_[b].range_m) > kCut_m;
  };
  std::size_t cut = 1;
  if (spin_.is_leftward) {
    while (cut < count && !jumps(begin + cut, begin + cut - 1)) ++cut;
  } else {
    while (cut < count && !jumps(end - 1 - cut, end - cut)) ++cut;
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

void RingCloud::measure_step(std::size_t ring) {
  differences_.clear();
  const std::size_t stride = std::max<std::size_t>(4, (ends_[ring] - begins_[ring]) / kSteps);
  for (std::size_t i = begins_[ring] + 1; i < ends_[ring]; i += stride) {
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

float RingCloud::slope(std::size_t ring, float azimuth_rad) const {
  const RingPoint* near = &points_[std::min(first_at(ring, azimuth_rad), ends_[ring] - 1)];
  if (std::abs(std::remainder(near->azimuth_rad - azimuth_rad, kTurn)) < kKnownSlope_rad) {
    return (near->z_m - sensor_.z()) / near->range_m;
  }
  return rough_slope(ring, {std::cos(azimuth_rad), std::sin(azimuth_rad)});
}

float RingCloud::rough_slope(std::size_t ring, const Eigen::Vector2f& towards) const {
  Eigen::Vector3f beam = level_R_vehicle_.transpose().leftCols<2>() * towards;
  beam.z() = spin_.slopes[ring] * beam.head<2>().norm();
  beam = level_R_vehicle_ * beam;
  return beam.z() / beam.head<2>().norm();
}

}  // namespace understory
