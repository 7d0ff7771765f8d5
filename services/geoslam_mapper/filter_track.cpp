#include "services/geoslam_mapper/filter_track.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>

namespace understory {
namespace {

constexpr Utime kKept_us = 10'000'000;
/// A pose this near in time is carried over by its own velocity.
constexpr Utime kNear_us = 60'000;

}  // namespace

void FilterTrack::add(const EkfPose& pose) {
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

std::optional<SE2> FilterTrack::pose_at(Utime utime) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), utime,
                       [](const EkfPose& pose, Utime when) { return pose.utime < when; });
  const EkfPose* nearest = nullptr;
  if (after != poses_.end()) nearest = &*after;
  if (after != poses_.begin()) {
    const EkfPose& before = *std::prev(after);
    if (nearest == nullptr || utime - before.utime < nearest->utime - utime) nearest = &before;
  }
  if (nearest == nullptr || std::abs(utime - nearest->utime) > kNear_us) return std::nullopt;
  const double dt = 1e-6 * static_cast<double>(utime - nearest->utime);
  const Eigen::Vector2d way = dt * nearest->velocity_mps;
  return nearest->ekf_map_T_vehicle * SE2(way.x(), way.y(), 0.0);
}

std::optional<SE2> FilterTrack::between(Utime from, Utime to) const {
  const std::optional<SE2> first = pose_at(from);
  const std::optional<SE2> last = pose_at(to);
  if (!first || !last) return std::nullopt;
  return first->inverse() * *last;
}

}  // namespace understory
