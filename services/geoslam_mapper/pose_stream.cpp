#include "services/geoslam_mapper/pose_stream.hpp"

#include <algorithm>

namespace understory::geoslam_mapper {

std::optional<model::SlamPose> PoseStream::on_scan(const model::LandmarkScan& scan,
                                                   const std::optional<ScanPose>& found,
                                                   std::uint32_t map_id) {
  newest_scan_us_ = std::max(newest_scan_us_, scan.utime);
  if (!found || scan.utime <= newest_utime_) return std::nullopt;
  model::SlamPose pose;
  pose.utime = scan.utime;
  pose.is_coasting = found->is_coasting;
  pose.map_id = std::max(map_id, 1U);
  pose.is_provisional = is_provisional_;
  pose.submap_T_vehicle = found->map_T_vehicle.mean;
  pose.covariance =
      found->map_T_vehicle.covariance + given_covariance_at(found->map_T_vehicle.mean, pose.map_id);
  complete(pose);
  return pose;
}

PoseStream::OfKeyframe PoseStream::on_keyframe(const model::Keyframe& keyframe,
                                               const model::MapUpdate& update, bool is_new_map) {
  is_provisional_ = update.is_provisional;
  jumps_.add(keyframe, update);

  OfKeyframe result;
  const auto oldest_us = static_cast<model::Utime>(1e6 * limits_.oldest_pose_s);
  for (model::SlamPose& pose : poses_of(keyframe, update)) {
    if (pose.utime > counted_utime_) {
      counted_utime_ = pose.utime;
      ++result.counted;
    }
    // Keyframes may share scans; the published stamp always grows.
    const bool is_stale = newest_scan_us_ - pose.utime > oldest_us;
    if (pose.utime <= newest_utime_ || is_stale) continue;
    pose.is_new_map = is_new_map;
    complete(pose);
    result.poses.push_back(pose);
  }
  return result;
}

void PoseStream::complete(model::SlamPose& pose) {
  newest_utime_ = pose.utime;
  pose.map_T_odom = pose.map_T_vehicle() * odometry_.odom_T_vehicle(pose.utime).inverse();
  pose.reset_counter = jumps_.count();
  pose.reset_delta = jumps_.delta();
}

Eigen::Matrix3d PoseStream::given_covariance_at(const geometry::SE2& map_T_vehicle,
                                                std::uint32_t map_id) const {
  return map_id == given_frame_.map_id() ? given_frame_.covariance_at(map_T_vehicle)
                                         : Eigen::Matrix3d::Zero();
}

}  // namespace understory::geoslam_mapper
