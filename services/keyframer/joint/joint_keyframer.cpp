#include "services/keyframer/joint/joint_keyframer.hpp"

#include <utility>

#include "common/model/archive.hpp"

namespace understory::keyframer::joint {
namespace {

constexpr state::Format kFormat{"keyframer.joint", 1};

}  // namespace

JointKeyframer::JointKeyframer(const JointKeyframerParameters& parameters)
    : parameters_(parameters), tracker_(parameters) {}

void JointKeyframer::add(const model::Odometry& odometry) { odometry_.add(odometry); }

std::optional<model::Keyframe> JointKeyframer::add(const model::LandmarkScan& raw) {
  ++counters_.scans;
  if (last_utime_ && raw.utime <= *last_utime_) return refuse("scan not later than the last one");

  // Detections at the true level, and the motion since the last scan where odometry covers it.
  const model::LandmarkScan scan = level_.levelled(raw);
  std::optional<geometry::SE2WithCovariance> motion;
  if (last_utime_) motion = odometry_.between(*last_utime_, scan.utime);

  // Where the scan was made, and which detection is which landmark.
  std::optional<PlacedScan> placed = tracker_.add(scan, motion);
  if (!placed) return start_anew(scan);

  // Enough scans are one keyframe.
  gather({scan, std::move(*placed), motion});
  const auto full = static_cast<std::size_t>(parameters_.observations_per_keyframe);
  return members_.size() < full ? std::nullopt : finish();
}

std::optional<model::Keyframe> JointKeyframer::refuse(std::string reason) {
  ++counters_.scans_unmatched;
  counters_.last_reason = std::move(reason);
  return std::nullopt;
}

/// The chain of scans is broken: what was gathered is given out, and tracking starts at this scan.
std::optional<model::Keyframe> JointKeyframer::start_anew(const model::LandmarkScan& scan) {
  std::optional<model::Keyframe> result =
      refuse("scan matches too few of the landmarks of the scans before it");
  if (members_.size() >= 2) {
    result = finish();
  } else if (!members_.empty()) {
    ++counters_.keyframes_withheld;
    members_.clear();
  }

  local_T_previous_base_.reset();
  gather({scan, tracker_.restart(scan), std::nullopt});
  return result;
}

void JointKeyframer::gather(Member member) {
  last_utime_ = member.scan.utime;
  odometry_.forget_before(member.scan.utime);
  members_.push_back(std::move(member));
}

std::optional<model::Keyframe> JointKeyframer::finish() {
  const std::vector<Member> members = std::exchange(members_, {});
  const MemberBlock block = adjust_members(members, tracker_.map(), parameters_.min_observations);
  if (auto reason = why_unusable(members, block)) {
    ++counters_.keyframes_withheld;
    counters_.last_reason = std::move(*reason);
    return std::nullopt;
  }

  model::Keyframe keyframe = to_keyframe(members, block, tracker_.map());
  keyframe.sequence = next_sequence_++;

  // How the base has moved since the base of the keyframe before, as the scans were tracked.
  const geometry::SE2& local_T_base = members.front().placed.local_T_vehicle;
  if (local_T_previous_base_) {
    keyframe.previous_T_base = local_T_previous_base_->inverse() * local_T_base;
  }
  local_T_previous_base_ = local_T_base;
  ++counters_.keyframes;
  return keyframe;
}

std::string JointKeyframer::save() const { return state::save(kFormat, *this); }

void JointKeyframer::load(const std::string& bytes) {
  JointKeyframer loaded(parameters_);
  state::load(bytes, kFormat, loaded);
  *this = std::move(loaded);
}

}  // namespace understory::keyframer::joint
