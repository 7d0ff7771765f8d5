#include "services/keyframer/joint/joint_keyframer.hpp"

#include <algorithm>
#include <utility>

#include "common/model/archive.hpp"

namespace understory::keyframer::joint {
namespace {

/// Number of detections in both of two successive scans above which they contradict odometry if
/// almost none match at odometry's pose.
constexpr std::size_t kToContradict = 8;
/// Least share of the pairs with the stated sigmas that smaller sigmas must keep to be used
/// instead.
constexpr double kAsMany = 0.8;
/// A pause ends a keyframe: this multiple of the previous interval of scans, and this time. Common
/// landmarks must tie the members; odometry alone is not sufficient.
constexpr model::Utime kPauseFactor = 4;
constexpr model::Utime kLeastPause_us = 500'000;
/// Keyframes of fewer scans wait at the start until this number of scans shows the noise.
constexpr std::uint64_t kWaitingScans = 4;

constexpr state::Format kFormat{"keyframer.joint", 12};

std::vector<std::uint64_t> numbers_of(const PlacedScan& placed) {
  return {placed.tracks.begin(), placed.tracks.end()};
}

}  // namespace

JointKeyframer::JointKeyframer(const JointKeyframerParameters& parameters)
    : parameters_(parameters), tracker_(parameters), noise_(parameters.noise) {}

void JointKeyframer::add(const model::Odometry& odometry) {
  odometry_.add(odometry);
  calibration_.add(odometry);
}

std::optional<model::Keyframe> JointKeyframer::add(const model::LandmarkScan& raw) {
  ++counters_.scans;
  if (last_utime_ && raw.utime <= *last_utime_) {
    ++counters_.scans_refused;
    return refuse("scan not later than the last one");
  }

  std::optional<model::Keyframe> before;
  if (is_after_pause(raw.utime)) before = break_off();

  // Detections with the true level, and the motion since the last scan if odometry covers it.
  const model::LandmarkScan scan = level_.levelled(raw);
  std::optional<geometry::SE2WithCovariance> motion;
  std::optional<model::InertialMotion> inertial;
  if (last_utime_) {
    motion = odometry_.between(*last_utime_, scan.utime);
    inertial = odometry_.inertial(*last_utime_, scan.utime);
  }

  // The pose of the scan, and the association of its detections.
  std::optional<PlacedScan> placed = place(scan, motion);
  if (!placed) {
    auto result = start_anew(scan);
    return result ? std::move(result) : std::move(before);
  }

  // Enough scans make a keyframe.
  gather({scan, std::move(*placed), motion, inertial});
  return is_full() ? finish() : before;
}

bool JointKeyframer::is_after_pause(model::Utime utime) const {
  if (!last_utime_ || interval_us_ == 0) return false;
  const model::Utime passed_us = utime - *last_utime_;
  return passed_us >= kLeastPause_us && passed_us > kPauseFactor * interval_us_;
}

std::optional<PlacedScan> JointKeyframer::place(
    const model::LandmarkScan& stated, const std::optional<geometry::SE2WithCovariance>& motion) {
  std::optional<PlacedScan> placed = noise_.is_new()
                                         ? place_by_tries(stated, motion)
                                         : tracker_.add(noise_.corrected(stated), motion);
  if (!placed) return std::nullopt;

  // Does the landmarks' motion agree with odometry?
  const std::size_t in_both = std::min(noise_.seen_last(), stated.detections.size());
  noise_.add(stated, numbers_of(*placed));
  const auto step = noise_.step();
  calibration_.check(step);
  if (motion && !step && in_both >= kToContradict) calibration_.break_off();
  if (const auto way = noise_.motion()) calibration_.add(*way);
  calibration_.watch(stated.utime, noise_.motion_over(JumpWatch::kScans));
  return placed;
}

/// Tries the stated noise, then larger or smaller noise that fits the scan better.
std::optional<PlacedScan> JointKeyframer::place_by_tries(
    const model::LandmarkScan& stated, const std::optional<geometry::SE2WithCovariance>& motion) {
  const ScanTracker before = tracker_;
  std::optional<PlacedScan> placed = tracker_.add(noise_.corrected(stated), motion);
  // In far too wide gates nearly every detection finds a match.
  const double must_keep =
      placed ? kAsMany * static_cast<double>(noise_.in_common(stated, numbers_of(*placed))) : 0.0;

  for (const double factor : noise_.tries()) {
    if (placed && factor > 1.0) continue;
    ScanTracker tried = before;
    auto other = tried.add(model::DetectionNoise::rescaled(stated, factor), motion);
    if (!other || !noise_.explains(stated, numbers_of(*other), factor)) continue;
    if (static_cast<double>(noise_.in_common(stated, numbers_of(*other))) < must_keep) continue;
    tracker_ = std::move(tried);
    return other;
  }
  return placed;
}

bool JointKeyframer::is_full() const {
  return members_.size() >= static_cast<std::size_t>(parameters_.observations_per_keyframe);
}

std::optional<model::Keyframe> JointKeyframer::refuse(std::string reason) {
  ++counters_.scans_unmatched;
  counters_.last_reason = std::move(reason);
  return std::nullopt;
}

/// Tracking is interrupted: the gathered scans become a keyframe, and tracking restarts at this
/// scan.
std::optional<model::Keyframe> JointKeyframer::start_anew(const model::LandmarkScan& scan) {
  std::optional<model::Keyframe> result =
      refuse("scan matches too few of the landmarks of the scans before it");
  if (members_.size() >= 2) {
    result = break_off();
  } else if (!members_.empty()) {
    ++counters_.keyframes_withheld;
    members_.clear();
  }
  stop_waiting();

  local_T_previous_base_.reset();
  noise_.forget_while_new();
  PlacedScan first = tracker_.restart(noise_.corrected(scan));
  noise_.add(scan, numbers_of(first));
  gather({scan, std::move(first), std::nullopt, std::nullopt});
  return is_full() ? finish() : result;  // A keyframe of one scan: then none was gathered before.
}

void JointKeyframer::gather(Member member) {
  interval_us_ = last_utime_ ? member.scan.utime - *last_utime_ : 0;
  last_utime_ = member.scan.utime;
  odometry_.forget_before(member.scan.utime);
  members_.push_back(std::move(member));
}

std::optional<model::Keyframe> JointKeyframer::finish() {
  std::vector<Member> members = std::exchange(members_, {});
  if (counters_.scans < kWaitingScans && noise_.is_new()) {
    waiting_.push_back(std::move(members));
    return std::nullopt;
  }
  stop_waiting();
  return estimated(std::move(members));
}

/// The scans gathered until now, with the present local map.
std::optional<model::Keyframe> JointKeyframer::break_off() {
  stop_waiting();
  if (members_.empty()) return std::nullopt;
  return estimated(std::exchange(members_, {}));
}

void JointKeyframer::stop_waiting() {
  for (std::vector<Member>& members : std::exchange(waiting_, {})) {
    if (auto keyframe = estimated(std::move(members))) waited_.push_back(std::move(*keyframe));
  }
}

/// The keyframe of these scans, with the present estimate of their noise.
std::optional<model::Keyframe> JointKeyframer::estimated(std::vector<Member> members) {
  for (Member& member : members) member.scan = noise_.corrected(std::move(member.scan));
  const MemberBlock block = adjusted(members);
  if (auto reason = why_unusable(members, block)) {
    ++counters_.keyframes_withheld;
    counters_.last_reason = std::move(*reason);
    return std::nullopt;
  }

  model::Keyframe keyframe = to_keyframe(members, block, tracker_.map());
  keyframe.sequence = next_sequence_++;

  // Tracked motion of the base since the base of the previous keyframe.
  const geometry::SE2& local_T_base = members.front().placed.local_T_vehicle;
  if (local_T_previous_base_) {
    keyframe.previous_T_base = local_T_previous_base_->inverse() * local_T_base;
  }
  local_T_previous_base_ = local_T_base;
  ++counters_.keyframes;
  return keyframe;
}

/// The members' estimate, which also updates the IMU's bias.
MemberBlock JointKeyframer::adjusted(std::span<const Member> members) {
  // One scan after a restart of tracking no landmark can have two observations.
  const auto tracked = static_cast<int>(std::min<std::uint64_t>(tracker_.scans(), 1000));
  BlockRules rules{std::min(parameters_.min_observations, tracked),
                   parameters_.motion_sigma_m,
                   parameters_.motion_sigma_rad,
                   {}};

  // The first member's step is not in the block: it ends at the block's start.
  if (members.front().inertial) bias_.pass(*members.front().inertial);
  const auto with_imu = std::ranges::find_if(
      members.subspan(1), [](const Member& member) { return member.inertial && member.motion; });
  const bool has_imu = with_imu != members.subspan(1).end();
  if (has_imu) rules.bias = bias_.known(*with_imu->inertial, *with_imu->motion);

  MemberBlock block = adjust_members(members, tracker_.map(), rules);
  if (block.estimate.bias && block.estimate.determined) {
    bias_.learn(*block.estimate.bias);
  } else if (has_imu) {
    bias_.forget();
  }
  for (const Member& member : members.subspan(1)) {
    if (member.inertial) bias_.pass(*member.inertial);
  }
  return block;
}

std::string JointKeyframer::save() const { return state::save(kFormat, *this); }

void JointKeyframer::load(const std::string& bytes) {
  JointKeyframer loaded(parameters_);
  state::load(bytes, kFormat, loaded);
  *this = std::move(loaded);
}

}  // namespace understory::keyframer::joint
