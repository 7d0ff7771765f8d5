#include "services/geoslam_mapper/map_publishing.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

namespace understory::geoslam_mapper {
namespace {

constexpr int kExactDigits = std::numeric_limits<double>::max_digits10;

bool is_localised(const model::MapUpdate& update) {
  return update.status == model::MapUpdateStatus::kFirstMap ||
         update.status == model::MapUpdateStatus::kUpdated;
}

void write(std::ostream& out, const geometry::SE2& pose) {
  out << std::setprecision(kExactDigits) << pose.x() << ' ' << pose.y() << ' ' << pose.theta()
      << ' ';
}

geometry::SE2 read_pose(std::istream& in) {
  double x = 0.0;
  double y = 0.0;
  double theta = 0.0;
  in >> x >> y >> theta;
  return {x, y, theta};
}

void require_whole(const std::istream& in) {
  if (!in) throw std::runtime_error("the saved state of the mapper's outputs is not whole");
}

}  // namespace

model::MapDelta map_difference(const std::vector<model::MapLandmark>& before,
                               const std::vector<model::MapLandmark>& after,
                               const model::MapUpdate& update, double moved_m) {
  model::MapDelta delta;
  delta.utime = update.utime;
  delta.merged = update.merged;
  std::set<model::LandmarkId> merged;
  for (const auto& [old_id, new_id] : update.merged) merged.insert(old_id);
  auto old = before.begin();
  const auto gone = [&](const model::MapLandmark& landmark) {
    if (!merged.contains(landmark.id)) delta.removed.push_back(landmark.id);
  };
  for (const model::MapLandmark& landmark : after) {
    while (old != before.end() && old->id < landmark.id) gone(*old++);
    if (old == before.end() || old->id != landmark.id) {
      delta.added.push_back(landmark);
      continue;
    }
    const bool has_moved = (old->position_m - landmark.position_m).norm() > moved_m;
    if (has_moved) delta.moved.push_back(landmark);
    ++old;
  }
  while (old != before.end()) gone(*old++);
  return delta;
}

namespace {

auto place_of(std::vector<model::MapLandmark>& landmarks, model::LandmarkId id) {
  return std::lower_bound(
      landmarks.begin(), landmarks.end(), id,
      [](const model::MapLandmark& one, model::LandmarkId wanted) { return one.id < wanted; });
}

}  // namespace

model::MapDelta map_change(const std::vector<model::MapLandmark>& before,
                           const std::vector<model::MapLandmark>& changed,
                           const model::MapUpdate& update, double moved_m) {
  model::MapDelta delta;
  delta.utime = update.utime;
  delta.merged = update.merged;
  for (const model::MapLandmark& landmark : changed) {
    const auto old = std::lower_bound(
        before.begin(), before.end(), landmark.id,
        [](const model::MapLandmark& one, model::LandmarkId wanted) { return one.id < wanted; });
    if (old == before.end() || old->id != landmark.id) {
      delta.added.push_back(landmark);
    } else if ((old->position_m - landmark.position_m).norm() > moved_m) {
      delta.moved.push_back(landmark);
    }
  }
  return delta;
}

std::vector<model::MapLandmark> with_delta(std::vector<model::MapLandmark> landmarks,
                                           const model::MapDelta& delta) {
  const auto put = [&](const model::MapLandmark& landmark) {
    const auto place = place_of(landmarks, landmark.id);
    if (place != landmarks.end() && place->id == landmark.id) {
      *place = landmark;
    } else {
      landmarks.insert(place, landmark);
    }
  };
  const auto drop = [&](model::LandmarkId id) {
    const auto place = place_of(landmarks, id);
    if (place != landmarks.end() && place->id == id) landmarks.erase(place);
  };
  for (const model::MapLandmark& landmark : delta.added) put(landmark);
  for (const model::MapLandmark& landmark : delta.moved) put(landmark);
  for (const model::LandmarkId id : delta.removed) drop(id);
  for (const auto& [old_id, new_id] : delta.merged) drop(old_id);
  return landmarks;
}

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

std::string OdometryFrame::save() const {
  std::ostringstream out;
  out << poses_.size() << ' ';
  for (const Pose& pose : poses_) {
    out << pose.utime << ' ';
    write(out, pose.odom_T_vehicle);
  }
  return out.str();
}

void OdometryFrame::load(const std::string& state) {
  std::istringstream in(state);
  std::size_t size = 0;
  in >> size;
  if (size > kKept) in.setstate(std::ios::failbit);
  require_whole(in);
  poses_.clear();
  for (std::size_t i = 0; i < size; ++i) {
    model::Utime utime = 0;
    in >> utime;
    poses_.push_back({utime, read_pose(in)});
  }
  require_whole(in);
}

std::vector<model::SlamPose> poses_of(const model::Keyframe& keyframe,
                                      const model::MapUpdate& update) {
  model::SlamPose pose;
  pose.status = update.status;
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

void JumpWatch::add(const model::Keyframe& keyframe, const model::MapUpdate& update) {
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

std::string JumpWatch::save() const {
  std::ostringstream out;
  out << predicted_.has_value() << ' ' << count_ << ' ';
  write(out, predicted_.value_or(geometry::SE2()));
  write(out, delta_);
  return out.str();
}

void JumpWatch::load(const std::string& state) {
  std::istringstream in(state);
  bool has_prediction = false;
  in >> has_prediction >> count_;
  predicted_ = read_pose(in);
  if (!has_prediction) predicted_.reset();
  delta_ = read_pose(in);
  require_whole(in);
}

}  // namespace understory::geoslam_mapper
