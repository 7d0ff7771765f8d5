#include "common/packets/sweep_builder.hpp"

#include <algorithm>
#include <utility>

namespace understory::packets {
namespace {

std::int64_t whole_us_below(std::int64_t time_ns) {
  return time_ns >= 0 ? time_ns / 1000 : -((-time_ns + 999) / 1000);
}

}  // namespace

void SweepBuilder::add(const Eigen::Vector3f& position_m, std::int64_t time_ns, std::uint16_t ring,
                       std::uint8_t intensity) {
  if (points_.size() >= kMostPoints) return;
  model::SweepPoint point;
  point.x_m = position_m.x();
  point.y_m = position_m.y();
  point.z_m = position_m.z();
  point.ring = ring;
  point.intensity = intensity;
  points_.push_back(point);
  times_ns_.push_back(time_ns);
}

void SweepBuilder::clear() {
  points_.clear();
  times_ns_.clear();
}

std::optional<model::PointSweep> SweepBuilder::take() {
  if (points_.empty()) return std::nullopt;
  model::PointSweep sweep;
  sweep.utime = whole_us_below(std::ranges::min(times_ns_));
  for (std::size_t i = 0; i < points_.size(); ++i)
    points_[i].time_s =
        static_cast<float>(1e-9 * static_cast<double>(times_ns_[i] - sweep.utime * 1000));

  sweep.rings = rings_;
  sweep.max_range_m = max_range_m_;
  sweep.revolution = revolutions_++;
  sweep.sequence = sweep.revolution;
  const std::size_t points = points_.size();
  sweep.points = std::exchange(points_, {});
  points_.reserve(points);
  times_ns_.clear();

  const auto is_before = [](const model::SweepPoint& a, const model::SweepPoint& b) {
    return a.time_s < b.time_s || (a.time_s == b.time_s && a.ring < b.ring);
  };
  if (!std::ranges::is_sorted(sweep.points, is_before))
    std::ranges::stable_sort(sweep.points, is_before);
  return sweep;
}

}  // namespace understory::packets
