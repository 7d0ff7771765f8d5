#include "services/landmark_extractor/rings/ring_slots.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory::landmark_extractor::rings {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kFullTurn = 2.0F * kPi;
/// A ring may be cut between neighbouring returns that differ in range by more than this.
constexpr float kCut_m = 1.0F;
/// Distance of the prefetch in points.
constexpr std::ptrdiff_t kAhead = 4;

}  // namespace

void RingSlots::fill(const model::PointSweep& sweep, const points::Levelling& levelling,
                     bool is_leftward, const ground::GroundSurface& ground,
                     PointCounters& counters) {
  is_leftward_ = is_leftward;
  std::size_t points_per_ring = sweep.points.size() / sweep.rings;
  PointCounters of_this;
  do {
    points_per_ring += points_per_ring / 4 + 1;
    reserve(sweep.rings, points_per_ring);
    of_this = {};
  } while (!scatter(sweep, levelling, ground, of_this));
  counters.not_finite += of_this.not_finite;
  counters.bad_ring += of_this.bad_ring;
}

void RingSlots::reserve(std::size_t rings, std::size_t points_per_ring) {
  if (slot_ < 2 * points_per_ring) {
    // Half as much again, so that slowly growing sweeps rarely reallocate; an odd number of cache
    // lines, so that the rings' ends do not fall into a few cache sets.
    constexpr std::size_t kUnit = 2;
    slot_ = (3 * points_per_ring / kUnit | 1U) * kUnit;
  }
  if (capacity_ < rings * slot_) {
    points_.reset();
    capacity_ = rings * slot_;
    points_ = std::make_unique_for_overwrite<points::RingPoint[]>(capacity_);
  }

  filling_.resize(rings);
  const auto most = static_cast<std::ptrdiff_t>(slot_ / 2);
  for (std::size_t ring = 0; ring < rings; ++ring) {
    points::RingPoint* first = points_.get() + ring * slot_ + (is_leftward_ ? 0 : slot_ - 1);
    filling_[ring] = {first, is_leftward_ ? first + most : first - most,
                      std::numeric_limits<float>::quiet_NaN(), 0.0F};
  }
}

bool RingSlots::scatter(const model::PointSweep& sweep, const points::Levelling& levelling,
                        const ground::GroundSurface& ground, PointCounters& counters) {
  // Copies, so that writes to a point cannot change them.
  const std::ptrdiff_t forward = is_leftward_ ? 1 : -1;
  const std::uint16_t rings = sweep.rings;
  Filling* const filling = filling_.data();
  points::PointBlock& block = block_;
  far_.clear();

  for (std::size_t first = 0; first < sweep.points.size(); first += points::PointBlock::kSize) {
    const std::size_t count = std::min(points::PointBlock::kSize, sweep.points.size() - first);
    const model::SweepPoint* const points = sweep.points.data() + first;
    place_block({points, count}, levelling, ground.grid(), ground.patches(), block);
    for (std::size_t i = 0; i < count; ++i) {
      const points::RingPoint point = block.points[i];
      const std::uint16_t ring = points[i].ring;
      if (point.is_in_range == 0.0F || ring >= rings) {
        if (ring >= rings) {
          ++counters.bad_ring;
        } else if (!points[i].position().allFinite()) {
          ++counters.not_finite;
        } else if (point.range_m > levelling.max_range_m) {
          far_.push_back(point);
        }
        continue;
      }

      // The azimuth is continuous beyond pi within a ring.
      Filling& here = filling[ring];
      points::RingPoint* const place = here.next;
      if (place == here.full) return false;
      float azimuth = point.azimuth_rad + here.turned_rad;
      const float change = azimuth - here.azimuth_rad;
      if (std::abs(change) > kPi) {
        const float turn = change > 0.0F ? -kFullTurn : kFullTurn;
        here.turned_rad += turn;
        azimuth += turn;
      }

      here.azimuth_rad = azimuth;
      here.next = place + forward;
      *place = point;
      place->azimuth_rad = azimuth;
      // With one stream per ring the processor's own prefetcher does not keep up.
      __builtin_prefetch(place + kAhead * forward, 1);
    }
  }
  return true;
}

IndexRange RingSlots::cut(std::size_t ring, float lowest_m) {
  const points::RingPoint* const slot = points_.get() + ring * slot_;
  const points::RingPoint* const next = filling_[ring].next;
  const auto count = static_cast<std::size_t>(is_leftward_ ? next - slot : slot + slot_ - 1 - next);
  const std::size_t begin = is_leftward_ ? ring * slot_ : (ring + 1) * slot_ - count;
  const std::size_t end = begin + count;

  // Cuts at the ground, or at a jump of the range.
  const auto parts = [&](std::size_t a, std::size_t b) {
    return points_[a].height_m <= lowest_m ||
           std::abs(points_[a].range_m - points_[b].range_m) > kCut_m;
  };
  std::size_t cut = 1;
  if (is_leftward_) {
    while (cut < count && !parts(begin + cut, begin + cut - 1)) ++cut;
  } else {
    while (cut < count && !parts(end - 1 - cut, end - cut)) ++cut;
  }
  if (cut >= count) return {begin, end};

  const std::size_t from = is_leftward_ ? begin : end - cut;
  const std::size_t to = is_leftward_ ? end : begin - cut;
  // The azimuth increases by less than half a turn across the joined ends.
  const float ascent = is_leftward_ ? points_[from].azimuth_rad - points_[end - 1].azimuth_rad
                                    : points_[begin].azimuth_rad - points_[end - 1].azimuth_rad;
  const float turn = kFullTurn * std::round(ascent / kFullTurn) * (is_leftward_ ? -1.0F : 1.0F);
  for (std::size_t i = 0; i < cut; ++i) {
    points_[to + i] = points_[from + i];
    points_[to + i].azimuth_rad += turn;
  }
  return is_leftward_ ? IndexRange{begin + cut, end + cut} : IndexRange{begin - cut, end - cut};
}

}  // namespace understory::landmark_extractor::rings
