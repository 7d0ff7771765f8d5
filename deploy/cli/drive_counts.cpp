#include "deploy/cli/drive_counts.hpp"

#include "common/model/sensor_channel.hpp"

namespace understory::cli {
namespace {

/// Whether it is a sensor's channel or known from outside of the run.
bool is_outside(const std::string& channel) {
  return channel == "GROUND_TRUTH" || channel == "TRUTH_LANDMARKS" ||
         model::is_sensor_channel(channel);
}

std::string status_of(const model::SlamPose& pose) {
  if (!pose.status) return pose.is_coasting ? "coasting" : "tracked";
  switch (*pose.status) {
    case model::MapUpdateStatus::kFirstMap:
      return pose.is_new_map ? "new_map" : "first_map";
    case model::MapUpdateStatus::kUpdated:
      return "updated";
    case model::MapUpdateStatus::kNotSure:
      return pose.is_lost ? "lost" : "not_sure";
    case model::MapUpdateStatus::kRolledBack:
      return "rolled_back";
    case model::MapUpdateStatus::kRejected:
      return "rejected";
  }
  return "?";
}

void count_result(const model::LoopResult& result, ClosureCounts& counts) {
  switch (result.status) {
    case model::LoopResult::Status::kAccepted:
      ++counts.accepted;
      break;
    case model::LoopResult::Status::kWaiting:
      ++counts.waiting;
      break;
    case model::LoopResult::Status::kRevoked:
      ++counts.revoked;
      break;
    case model::LoopResult::Status::kRefused:
      ++counts.refused;
      ++counts.refused_by_reason[result.reason];
      break;
  }
}

}  // namespace

void DriveCounter::take(const io::LogEvent& event) {
  if (!is_outside(event.channel)) counts_.bytes_by_channel[event.channel] += event.data.size();
  if (event.channel == "KEYFRAME") ++counts_.keyframes_sent;
}

void DriveCounter::take(const model::SlamPose& pose) {
  ++counts_.poses_by_status[status_of(pose)];
  // A mapper restarted without its state counts from 0 again.
  if (reset_counter_ && pose.reset_counter > *reset_counter_)
    counts_.reset_counter_steps += pose.reset_counter - *reset_counter_;
  reset_counter_ = pose.reset_counter;
}

void DriveCounter::take(const model::MapUpdate& update) {
  const bool has_pose = update.status == model::MapUpdateStatus::kFirstMap ||
                        update.status == model::MapUpdateStatus::kUpdated;
  if (!has_pose) ++counts_.keyframes_without_pose;
}

void DriveCounter::take(const model::LoopClosure& closure) {
  if (!closure.is_revoked) closures_.try_emplace({closure.map_id, closure.id});
}

void DriveCounter::take(const model::LoopResult& result) {
  const auto found = closures_.find({result.map_id, result.closure_id});
  if (found != closures_.end()) found->second = result;
}

DriveCounts DriveCounter::counts() const {
  DriveCounts counts = counts_;
  counts.closures.sent = closures_.size();
  for (const auto& [key, result] : closures_) {
    if (result) count_result(*result, counts.closures);
  }
  return counts;
}

}  // namespace understory::cli
