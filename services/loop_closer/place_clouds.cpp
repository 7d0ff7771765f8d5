#include "services/loop_closer/place_clouds.hpp"

#include <algorithm>

namespace understory::loop_closer {

void PlaceClouds::add(model::PlaceScan scan) {
  pending_.push_back(std::move(scan));
  if (pending_.size() > kMostPending) pending_.pop_front();
}

void PlaceClouds::add(const model::Keyframe& keyframe, const model::MapUpdate& update,
                      double along_m) {
  const geometry::SE2 map_T_centre = update.map_T_vehicle * keyframe.centre_T_base().inverse();
  // Its base is one of its scans, but not the last one.
  model::Utime end = keyframe.utime;
  for (const model::KeyframeMember& member : keyframe.members) end = std::max(end, member.utime);
  while (!pending_.empty() && pending_.front().utime <= end) {
    model::PlaceScan scan = std::move(pending_.front());
    pending_.pop_front();
    const auto member =
        std::ranges::find(keyframe.members, scan.utime, &model::KeyframeMember::utime);
    // The pose of a scan outside all keyframes is unknown.
    if (member == keyframe.members.end()) continue;
    newest_ = PlacedCloud{along_m, map_T_centre * member->centre_T_vehicle, std::move(scan.points)};
  }
}

std::vector<model::PlacePoint> PlaceClouds::seen_from(const geometry::SE2& map_T_base,
                                                      double from_m) const {
  std::vector<model::PlacePoint> result;
  if (!newest_ || newest_->along_m < from_m) return result;
  const geometry::SE2 base_T_scan = map_T_base.inverse() * newest_->map_T_scan;
  result.reserve(newest_->points.size());
  for (const model::PlacePoint& point : newest_->points) {
    const Eigen::Vector3f at = point.position_m();
    const Eigen::Vector2d moved = base_T_scan * Eigen::Vector2d(at.head<2>().cast<double>());
    const Eigen::Vector3f seen(static_cast<float>(moved.x()), static_cast<float>(moved.y()),
                               at.z());
    if (seen.cwiseAbs().maxCoeff() <= model::kMostDistantPlacePointM)
      result.push_back(model::place_point(seen));
  }
  return result;
}

}  // namespace understory::loop_closer
