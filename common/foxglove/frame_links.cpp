#include "common/foxglove/frame_links.hpp"

#include <cstdlib>

#include "common/foxglove/scene.hpp"

namespace understory::foxglove {

void RecentPoses::add(model::Utime utime, const geometry::SE2& pose) {
  if (!poses_.empty() && utime <= poses_.back().first) {
    // The clock went back: another drive.
    if (poses_.front().first - utime > kTolerance_us) poses_.clear();
    if (!poses_.empty()) return;
  }
  poses_.emplace_back(utime, pose);
  if (poses_.size() > kMost) poses_.pop_front();
}

std::optional<geometry::SE2> RecentPoses::at(model::Utime utime) const {
  std::optional<geometry::SE2> best;
  model::Utime nearest = kTolerance_us + 1;
  for (const auto& [stamp, pose] : poses_) {
    const model::Utime distance = std::abs(stamp - utime);
    if (distance >= nearest) continue;
    nearest = distance;
    best = pose;
  }
  return best;
}

void FrameLinks::take(const model::EkfPose& pose) {
  filter_.add(pose.utime, pose.ekf_map_T_vehicle);
  if (pose_ && pose_->utime == pose.utime) {
    map_T_ekf_map_ = pose_->map_T_vehicle() * pose.ekf_map_T_vehicle.inverse();
  }
}

void FrameLinks::take_truth(model::Utime utime, const geometry::SE2& world_T_vehicle) {
  truth_.add(utime, world_T_vehicle);
}

void FrameLinks::take(const model::SlamPose& pose) {
  if (!is_usable(pose)) return;
  if (pose_ && pose_->map_id != pose.map_id) map_T_world_.reset();
  pose_ = pose;
  const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
  if (const auto filter = filter_.at(pose.utime)) {
    map_T_ekf_map_ = map_T_vehicle * filter->inverse();
  }
  if (map_T_world_ || !pose.is_localised()) return;
  if (const auto truth = truth_.at(pose.utime)) map_T_world_ = map_T_vehicle * truth->inverse();
}

std::vector<FrameLink> FrameLinks::links() const {
  std::vector<FrameLink> result;
  if (!pose_) return result;
  result.push_back({kMapFrame, kVehicleFrame, pose_->map_T_vehicle()});
  result.push_back({kMapFrame, "odom", pose_->map_T_odom});
  if (map_T_ekf_map_) result.push_back({kMapFrame, "ekf_map", *map_T_ekf_map_});
  if (map_T_world_) result.push_back({kMapFrame, "world", *map_T_world_});
  return result;
}

std::optional<geometry::SE2> FrameLinks::true_pose() const {
  if (!pose_ || !map_T_world_) return std::nullopt;
  const auto truth = truth_.at(pose_->utime);
  if (!truth) return std::nullopt;
  return *map_T_world_ * *truth;
}

bool is_usable(const model::SlamPose& pose) { return pose.is_localised() || pose.is_coasting; }

}  // namespace understory::foxglove
