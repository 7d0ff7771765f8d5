#include "common/foxglove/single_messages.hpp"

#include <algorithm>
#include <array>

#include "common/foxglove/messages.hpp"
#include "common/foxglove/numbers.hpp"
#include "common/wire/checks.hpp"
#include "common/wire/convert.hpp"

namespace understory::foxglove {
namespace {

std::string_view result_text(model::LoopResult::Status status) {
  constexpr std::array<std::string_view, 4> kTexts{"accepted", "waiting", "refused", "revoked"};
  return kTexts[std::min<std::size_t>(static_cast<std::size_t>(status), 3)];
}

}  // namespace

bool give_message(Outbox& out, const model::MapCorrection& correction) {
  out.give(TopicId::kSubmapTransforms, correction.utime, frame_transforms(correction));
  return true;
}

bool give_message(Outbox& out, const model::LandmarkScan& scan) {
  out.give(TopicId::kDetections, scan.utime, detections_scene(scan));
  return true;
}

bool give_message(Outbox& out, const lidar_scan_t& scan) {
  wire::Checks checks;
  checks.pose("vehicle_T_sensor", scan.vehicle_T_sensor);
  if (checks.refusal() || !wire::from_wire(scan)) return false;
  out.give(TopicId::kScan, scan.utime, laser_scan(scan));
  return true;
}

bool give_message(Outbox& out, const model::RawPose& pose) {
  const TopicId id = pose.is_reference ? TopicId::kReference : TopicId::kDeadReckoning;
  const std::string_view frame = pose.is_reference ? "reference" : "odom";
  out.give(id, pose.utime, pose_in_frame(pose.utime, frame, pose.odom_T_vehicle));
  return true;
}

bool give_message(Outbox& out, const truth_landmarks_t& truth) {
  wire::Checks checks;
  for (const truth_landmark_t& one : truth.landmarks) {
    checks.pose("position_m", {one.position_m[0], one.position_m[1], 0.0});
    checks.range("radius_m", one.radius_m, 0.0, 1e3);
  }
  if (checks.refusal()) return false;
  out.give(TopicId::kTruthLandmarks, truth.utime, truth_scene(truth));
  return true;
}

bool give_message(Outbox& out, const gnss_t& fix) {
  if (!wire::from_wire(fix)) return fix.valid == 0;
  if (fix.has_geodetic != 0) out.give(TopicId::kFix, fix.utime, location_fix(fix));
  out.give(TopicId::kLocalFix, fix.utime,
           pose_in_frame(fix.utime, "gnss", geometry::SE2(fix.east_m, fix.north_m, 0.0)));
  return true;
}

bool give_message(Outbox& out, const log_t& line) {
  out.give(TopicId::kLog, line.utime, log_line(line));
  return true;
}

bool give_message(Outbox& out, const health_t& health) {
  out.give(TopicId::kHealthNumbers, health.utime, to_json(health));
  return true;
}

bool give_message(Outbox& out, const model::LoopClosure& closure) {
  const LoopNumbers numbers{closure.utime, closure.id, closure.source,
                            closure.is_revoked ? "revoked" : "sent", ""};
  out.give(TopicId::kLoopNumbers, closure.utime, to_json(numbers));
  return true;
}

bool give_message(Outbox& out, const model::LoopResult& result) {
  const LoopNumbers numbers{result.utime, result.closure_id, "",
                            std::string(result_text(result.status)), result.reason};
  out.give(TopicId::kLoopNumbers, result.utime, to_json(numbers));
  return true;
}

bool give_message(Outbox& out, const model::ImuSample& sample) {
  out.give(TopicId::kImuNumbers, sample.utime, to_json(sample));
  return true;
}

}  // namespace understory::foxglove
