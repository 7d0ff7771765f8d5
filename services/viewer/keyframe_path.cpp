#include "services/viewer/keyframe_path.hpp"

#include <algorithm>
#include <cmath>

namespace understory::viewer {
namespace {

/// Smaller moves are not visible on a page [m].
constexpr float kMoved_m = 0.002F;

TrackPoint point_of(const model::KeyframePose& keyframe) {
  TrackPoint point;
  point.utime = keyframe.utime;
  point.x_m = static_cast<float>(keyframe.map_T_vehicle.x());
  point.y_m = static_cast<float>(keyframe.map_T_vehicle.y());
  point.theta_rad = static_cast<float>(keyframe.map_T_vehicle.theta());
  return point;
}

}  // namespace

void KeyframePath::take(std::span<const model::KeyframePose> keyframes) {
  const std::size_t known = points_.size();
  std::size_t first_moved = known;
  for (const model::KeyframePose& keyframe : keyframes) {
    const TrackPoint point = point_of(keyframe);
    const auto [found, is_new] = index_of_.try_emplace(keyframe.keyframe_sequence, points_.size());
    if (is_new) {
      if (points_.size() >= Track::kMostPoints) return;
      points_.push_back(point);
      continue;
    }
    TrackPoint& before = points_[found->second];
    if (std::hypot(before.x_m - point.x_m, before.y_m - point.y_m) < kMoved_m) continue;
    before = point;
    first_moved = std::min(first_moved, found->second);
  }

  if (first_moved == known && points_.size() == known) return;
  if (first_moved == known) {
    for (std::size_t i = known; i < points_.size(); ++i) track_.append(points_[i]);
  } else {
    track_.replace_from(first_moved, std::span(points_).subspan(first_moved));
  }
}

std::optional<geometry::SE2> KeyframePath::find(std::uint64_t keyframe_sequence) const {
  const auto found = index_of_.find(keyframe_sequence);
  if (found == index_of_.end()) return std::nullopt;
  const TrackPoint& point = points_[found->second];
  return geometry::SE2(point.x_m, point.y_m, point.theta_rad);
}

void KeyframePath::clear() {
  track_.clear();
  index_of_.clear();
  points_.clear();
}

}  // namespace understory::viewer
