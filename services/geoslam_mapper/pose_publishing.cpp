#include "services/geoslam_mapper/pose_publishing.hpp"

#include <algorithm>
#include <cmath>

namespace understory::geoslam_mapper {
namespace {

bool is_localised(const model::MapUpdate& update) {
  return update.status == model::MapUpdateStatus::kFirstMap ||
         update.status == model::MapUpdateStatus::kUpdated;
}

}  // namespace

void OdometryFrame::add(const model::Odometry& motion) {
  const geometry::SE2 last = poses_.empty() ? geometry::SE2() : poses_.back().odom_T_vehicle;
  if (poses_.empty()) poses_.push_back({motion.from_utime, last});
  poses_.push_back({motion.utime, last * motion.from_T_to});
  if (poses_.size() > kKept) poses_.pop_front();
}

geometry::SE2 OdometryFrame::odom_T_vehicle(model::Utime utime) const {
  const auto behind =
      std::upper_bound(poses_.begin(), poses_.end(), utime,
                       [](model::Utime t, const Pose& pose) { return t < pose.utime; });
  if (behind == poses_.begin())
    return poses_.empty() ? geometry::SE2() : poses_.front().odom_T_vehicle;
  return std::prev(behind)->odom_T_vehicle;
}

std::vector<model::SlamPose> poses_of(const model::Keyframe& keyframe,
                                      const model::MapUpdate& update) {
  model::SlamPose pose;
  pose.status = update.status;
  pose.map_id = update.map_id;
  pose.is_provisional = update.is_provisional;
  pose.is_lost = update.is_lost;
  pose.keyframe_sequence = keyframe.sequence;
  pose.utime = keyframe.members.back().utime;
  if (!is_localised(update)) return {pose};

  std::vector<model::SlamPose> poses;
  const geometry::SE2 base_T_centre = keyframe.centre_T_base().inverse();
  for (const model::KeyframeMember& member : keyframe.members) {
    const geometry::SE2 base_T_vehicle = base_T_centre * member.centre_T_vehicle;
    const bool is_base = &member == &keyframe.members.front();
    const Eigen::Matrix3d own = is_base ? Eigen::Matrix3d::Zero() : member.covariance;
    const geometry::SE2WithCovariance map_T_vehicle =
        geometry::compound({update.map_T_vehicle, update.covariance}, {base_T_vehicle, own});

    pose.utime = member.utime;
    pose.submap_T_vehicle = map_T_vehicle.mean;
    pose.covariance = map_T_vehicle.covariance;
    poses.push_back(pose);
  }
  poses.back().submap_T_vehicle = update.map_T_latest_vehicle;
  return poses;
}

void identify_detections(const model::Keyframe& keyframe, model::MapUpdate& update) {
  if (!is_localised(update)) return;
  std::vector<model::LandmarkId> id_of(keyframe.landmarks.size(), 0);
  for (const model::Association& pair : update.associations)
    id_of.at(pair.keyframe_landmark) = pair.landmark_id;

  for (const model::KeyframeMember& member : keyframe.members)
    update.scans.push_back({member.utime, member.sequence});
  for (const model::KeyframeDetection& one : keyframe.detections)
    update.detections.push_back({one.member, one.detection, id_of.at(one.landmark)});
}

NumbersAfterLoss numbers_after_loss(std::int64_t written_s) {
  const auto seconds = static_cast<std::uint64_t>(std::max<std::int64_t>(written_s, 1));
  return {1000 + static_cast<std::uint32_t>(seconds / 10 % 30'000), seconds};
}

void JumpWatch::add(const model::Keyframe& keyframe, const model::MapUpdate& update) {
  if (update.map_id != map_id_) begin_map(update.map_id);
  if (predicted_ && keyframe.previous_T_base) {
    predicted_ = *predicted_ * *keyframe.previous_T_base;
  } else {
    predicted_.reset();
  }
  if (!is_localised(update)) return;

  if (predicted_) {
    const geometry::SE2 jump = predicted_->inverse() * update.map_T_vehicle;
    if (jump.translation().norm() > distance_m_ || std::abs(jump.theta()) > angle_rad_) {
      ++count_;
      delta_ = jump;
    }
  }
  predicted_ = update.map_T_vehicle;
}

/// The motion from one map's frame to the other's is unknown.
void JumpWatch::begin_map(std::uint32_t map_id) {
  if (map_id_ != 0) {
    ++count_;
    delta_ = geometry::SE2();
  }
  map_id_ = map_id;
  predicted_.reset();
}

}  // namespace understory::geoslam_mapper
