#include "services/geoslam_mapper/smoothing/filter_track.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr model::Utime kKept_us = 10'000'000;
/// A pose within this time is extrapolated by its own velocity.
constexpr model::Utime kNear_us = 60'000;

}  // namespace

void FilterTrack::add(const model::EkfPose& pose) {
  if (!poses_.empty()) {
    if (pose.reset_counter != poses_.back().reset_counter) {
      poses_.clear();
    } else if (pose.utime <= poses_.back().utime) {
      return;
    }
  }
  poses_.push_back(pose);
  while (poses_.front().utime + kKept_us < pose.utime) poses_.pop_front();
}

std::optional<geometry::SE2> FilterTrack::pose_at(model::Utime utime) const {
  const auto after = std::lower_bound(
      poses_.begin(), poses_.end(), utime,
      [](const model::EkfPose& pose, model::Utime when) { return pose.utime < when; });

  const model::EkfPose* nearest = nullptr;
  if (after != poses_.end()) nearest = &*after;
  if (after != poses_.begin()) {
    const model::EkfPose& before = *std::prev(after);
    if (nearest == nullptr || utime - before.utime < nearest->utime - utime) nearest = &before;
  }

  if (nearest == nullptr || std::abs(utime - nearest->utime) > kNear_us) return std::nullopt;

  const double dt = 1e-6 * static_cast<double>(utime - nearest->utime);
  const Eigen::Vector2d driven_m = dt * nearest->velocity_mps;
  return nearest->ekf_map_T_vehicle * geometry::SE2(driven_m.x(), driven_m.y(), 0.0);
}

std::optional<geometry::SE2> FilterTrack::between(model::Utime from, model::Utime to) const {
  const std::optional<geometry::SE2> first = pose_at(from);
  const std::optional<geometry::SE2> last = pose_at(to);
  if (!first || !last) return std::nullopt;
  return first->inverse() * *last;
}

}  // namespace understory::geoslam_mapper::smoothing
