#include "services/landmark_extractor/rings/ring_runs.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::landmark_extractor::rings {
namespace {

/// Up to this number of beams without return within an object are drop-outs.
constexpr float kDropOuts = 3.5F;
/// Largest distance of two neighbouring beams with returns, in steps.
constexpr float kNextBeam = 1.6F;
/// Neighbouring returns from bark or a wall, unlike leaves, differ in range by less than this.
constexpr float kSmooth_m = 0.06F;

class RunFinder {
 public:
  RunFinder(const RingCloud& cloud, const SweepParameters& parameters, std::size_t ring)
      : points_(cloud.points()),
        sensor_(cloud.sensor_m()),
        velocity_(cloud.level_velocity_mps()),
        begin_(cloud.ring_begin(ring)),
        end_(cloud.ring_end(ring)),
        ring_(ring),
        step_(cloud.step_rad(ring)),
        lowest_(static_cast<float>(parameters.min_height_m)),
        highest_(static_cast<float>(parameters.max_height_m)),
        break_distance_(static_cast<float>(parameters.break_distance_m)),
        break_per_range_(static_cast<float>(parameters.break_per_range)),
        clearance_(static_cast<float>(parameters.clearance_m)) {}

  void find(std::vector<Run>& runs) const {
    for (std::size_t i = begin_; i < end_;) {
      if (!is_object(points_[i])) {
        ++i;
        continue;
      }
      std::size_t last = i;
      while (last + 1 < end_ && is_object(points_[last + 1]) && joined(last, last + 1)) ++last;
      add(i, last, runs);
      i = last + 1;
    }
  }

 private:
  bool is_object(const points::RingPoint& point) const {
    return point.height_m > lowest_ && point.height_m < highest_;
  }

  bool joined(std::size_t a, std::size_t b) const {
    const points::RingPoint& p = points_[a];
    const points::RingPoint& q = points_[b];
    const float limit = break_distance_ + break_per_range_ * std::min(p.range_m, q.range_m);
    const float dx = p.x_m - q.x_m;
    const float dy = p.y_m - q.y_m;
    return dx * dx + dy * dy <= limit * limit && q.azimuth_rad - p.azimuth_rad <= kDropOuts * step_;
  }

  /// Difference of the azimuths of two points.
  float gap(std::size_t a, std::size_t b) const {
    const float gap = std::abs(points_[a].azimuth_rad - points_[b].azimuth_rad);
    return gap > std::numbers::pi_v<float> ? std::abs(gap - 2.0F * std::numbers::pi_v<float>) : gap;
  }

  /// Border at the point `edge`: `beyond` is its neighbour in the ring, `gap` rad away.
  planar::Border border(std::size_t edge, std::size_t beyond, float gap) const {
    const float behind = points_[beyond].range_m - points_[edge].range_m;
    if (gap > kDropOuts * step_) return planar::Border::kClear;
    if (behind < -clearance_) return planar::Border::kOccluded;
    if (gap > kNextBeam * step_ || behind > clearance_) return planar::Border::kClear;
    // Rising ground beside an object hides no part of it.
    return points_[beyond].height_m <= lowest_ ? planar::Border::kClear : planar::Border::kCrowded;
  }

  /// Ignores runs that are neither a slice of a trunk nor a piece of a wall.
  void add(std::size_t first, std::size_t last, std::vector<Run>& runs) const {
    Run run;
    run.first = static_cast<std::uint32_t>(first);
    run.last = static_cast<std::uint32_t>(last);
    run.ring = static_cast<std::uint16_t>(ring_);
    const std::size_t before = first > begin_ ? first - 1 : end_ - 1;
    const std::size_t after = last + 1 < end_ ? last + 1 : begin_;
    const float gap_before = gap(first, before);
    const float gap_after = gap(last, after);
    run.right = border(first, before, gap_before);
    run.left = border(last, after, gap_after);
    run.is_right_silent = gap_before > kNextBeam * step_;
    run.is_left_silent = gap_after > kNextBeam * step_;
    if (!run.stands_alone() && run.size() < kLeastOfWall) return;
    describe(run);
    runs.push_back(run);
  }

  void describe(Run& run) const {
    const std::size_t first = run.first;
    const std::size_t last = run.last;
    float nearest = points_[first].range_m;
    float z = 0.0F;
    float height = 0.0F;
    for (std::size_t i = first; i <= last; ++i) {
      nearest = std::min(nearest, points_[i].range_m);
      z += points_[i].z_m;
      height += points_[i].height_m;
    }
    const auto count = static_cast<float>(run.size());
    run.nearest_m = nearest;
    run.z_m = z / count;
    run.height_m = height / count;
    count_lost(run);
    run.width_m = nearest * (points_[last].azimuth_rad - points_[first].azimuth_rad + step_);
    place(run);
  }

  /// Beams between two returns from one smooth surface hit it, too.
  void count_lost(Run& run) const {
    for (std::size_t i = run.first; i < run.last; ++i) {
      const points::RingPoint& point = points_[i];
      const points::RingPoint& next = points_[i + 1];
      if (std::abs(next.range_m - point.range_m) > kSmooth_m) continue;
      const float steps = std::round((next.azimuth_rad - point.azimuth_rad) / step_);
      run.met += steps;
      run.lost += std::max(steps - 1.0F, 0.0F);
    }
  }

  void place(Run& run) const {
    const points::RingPoint& middle = points_[(run.first + run.last) / 2];
    const float behind = run.nearest_m + 0.5F * run.width_m;
    // Relative to a point of the run: the sensor moved during the revolution.
    const Eigen::Vector2f origin = sensor_.head<2>() + middle.time_s * velocity_.head<2>();
    const Eigen::Vector2f beam =
        (Eigen::Vector2f(middle.x_m, middle.y_m) - origin) / middle.range_m;
    // By a few steps at most, if the run belongs to a trunk.
    const float turn = 0.5F * (points_[run.first].azimuth_rad + points_[run.last].azimuth_rad) -
                       middle.azimuth_rad;
    const float cosine = 1.0F - 0.5F * turn * turn;
    run.x_m = origin.x() + behind * (cosine * beam.x() - turn * beam.y());
    run.y_m = origin.y() + behind * (cosine * beam.y() + turn * beam.x());
  }

  std::span<const points::RingPoint> points_;
  Eigen::Vector3f sensor_;
  Eigen::Vector3f velocity_;
  std::size_t begin_;
  std::size_t end_;
  std::size_t ring_;
  float step_;
  float lowest_;
  float highest_;
  float break_distance_;
  float break_per_range_;
  float clearance_;
};

}  // namespace

void find_runs(const RingCloud& cloud, const SweepParameters& parameters, std::size_t ring,
               std::vector<Run>& runs) {
  if (cloud.step_rad(ring) > 0.0F) RunFinder(cloud, parameters, ring).find(runs);
}

}  // namespace understory::landmark_extractor::rings
