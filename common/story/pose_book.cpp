#include "common/story/pose_book.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace understory::story {
namespace {

constexpr std::size_t kReasonBytes = 200;
constexpr std::size_t kScansNamed = 64;
constexpr std::size_t kAllocated = 16;  // Overhead of the allocator [bytes].

/// Finds the revolution of a part; parts arrive within a few messages.
LaserRecord* begun(History<LaserRecord>& channel, const model::PointSweep& part) {
  constexpr std::size_t kMixed = 4;
  for (std::size_t back = 1; back <= std::min(channel.size(), kMixed); ++back) {
    LaserRecord& one = channel.at(channel.size() - back);
    if (one.utime == part.utime && one.revolution == part.revolution) return &one;
  }
  return nullptr;
}

}  // namespace

double milliseconds(std::int64_t from_us, std::int64_t to_us) {
  return 1e-3 * (static_cast<double>(to_us) - static_cast<double>(from_us));
}

bool is_same_clock(model::Utime stamp, std::int64_t received_us) {
  const double behind_ms = milliseconds(stamp, received_us);
  return behind_ms >= 0.0 && behind_ms <= 60'000.0;
}

double largest_sigma_m(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>(),
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues().y()));
}

PoseBook::PoseBook(const Limits& limits)
    : poses_(limits.poses),
      updates_(limits.keyframes),
      keyframes_(limits.keyframes),
      scans_(limits.poses),
      tracked_(limits.poses),
      motions_(limits.odometry),
      filter_poses_(limits.poses),
      corrections_(limits.keyframes),
      lasers_(kLasers, History<LaserRecord>(limits.poses)) {}

std::size_t PoseBook::fixed_bytes(const Limits& limits) {
  return History<PoseRecord>::bytes_of(limits.poses) +
         2 * History<ScanRecord>::bytes_of(limits.poses) +
         History<FilterRecord>::bytes_of(limits.poses) +
         kLasers * History<LaserRecord>::bytes_of(limits.poses) +
         History<UpdateRecord>::bytes_of(limits.keyframes) +
         History<KeyframeRecord>::bytes_of(limits.keyframes) +
         History<CorrectionRecord>::bytes_of(limits.keyframes) +
         limits.keyframes * (kReasonBytes + kScansNamed * sizeof(model::Utime) + 2 * kAllocated) +
         History<MotionRecord>::bytes_of(limits.odometry);
}

std::size_t PoseBook::bytes() const {
  std::size_t sum = poses_.bytes() + scans_.bytes() + tracked_.bytes() + filter_poses_.bytes() +
                    corrections_.bytes() + motions_.bytes() + updates_.bytes() + keyframes_.bytes();
  for (const auto& laser : lasers_) sum += laser.bytes();
  for (const UpdateRecord& one : updates_) sum += one.reason.capacity() + kAllocated;
  for (const KeyframeRecord& one : keyframes_)
    sum += one.scans.capacity() * sizeof(model::Utime) + kAllocated;
  return sum;
}

Arrival PoseBook::arrive(std::int64_t received_us) {
  last_received_us_ = received_us;
  return {received_us, ++order_};
}

void PoseBook::take(const model::SlamPose& pose, std::int64_t received_us) {
  if (received_us == last_received_us_ || received_us == pose.utime) ++poses_at_once_;
  poses_.push({arrive(received_us), pose});
}

void PoseBook::take(const model::MapUpdate& update, std::int64_t received_us) {
  const auto count = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
  if (received_us == last_received_us_) ++updates_at_once_;
  UpdateRecord record;
  record.arrival = arrive(received_us);
  record.utime = update.utime;
  record.keyframe = update.keyframe_sequence;
  record.status = update.status;
  record.is_lost = update.is_lost;
  record.used_prior = update.used_prior;
  record.candidates = update.candidates;
  record.inliers = update.inliers;
  record.associations = count(update.associations);
  record.added = count(update.added);
  record.merged = count(update.merged);
  record.removed = count(update.removed);
  record.expected = count(update.expected);

  record.chi2 = update.chi2;
  record.degrees_of_freedom = update.degrees_of_freedom;
  record.log10_false_alarm = update.log10_false_alarm;
  record.reason = update.reason.substr(0, kReasonBytes);
  updates_.push(std::move(record));
}

void PoseBook::take(const model::Keyframe& keyframe, std::int64_t received_us) {
  KeyframeRecord record{arrive(received_us),       keyframe.utime,          keyframe.sequence,
                        keyframe.landmarks.size(), keyframe.members.size(), {}};
  const std::size_t named = std::min(keyframe.members.size(), kScansNamed);
  record.scans.reserve(named);
  for (std::size_t i = 0; i < named; ++i) record.scans.push_back(keyframe.members[i].utime);
  keyframes_.push(std::move(record));
}

void PoseBook::take(const model::LandmarkScan& scan, std::int64_t received_us) {
  scans_.push({arrive(received_us), scan.utime, scan.sequence, scan.detections.size()});
}

void PoseBook::take(const model::TrackedScan& scan, std::int64_t received_us) {
  tracked_.push({arrive(received_us), scan.utime, scan.sequence, scan.landmarks.size()});
}

void PoseBook::take(const model::Odometry& odometry, std::int64_t received_us) {
  motions_.push({arrive(received_us), odometry.from_utime, odometry.utime, odometry.from_T_to,
                 odometry.has_wheels, odometry.inertial.has_value(), odometry.is_stationary});
}

void PoseBook::take(const model::EkfPose& pose, std::int64_t received_us) {
  filter_poses_.push({arrive(received_us), pose.utime, largest_sigma_m(pose.covariance),
                      pose.landmarks_used, pose.landmarks_refused});
}

void PoseBook::take(const model::MapCorrection& correction, std::int64_t received_us) {
  corrections_.push(
      {arrive(received_us), correction.utime, correction.version, correction.submaps.size()});
}

void PoseBook::take(const model::PlanarScan& scan, bool is_raw, std::int64_t received_us) {
  const Arrival arrival = arrive(received_us);
  lasers_[static_cast<std::size_t>(is_raw ? Laser::kRawScan : Laser::kScan)].push(
      {arrival, received_us, scan.utime, scan.sequence, 1, 1, scan.ranges_m.size()});
}

void PoseBook::take(const model::PointSweep& part, bool is_raw, std::int64_t received_us) {
  const Arrival arrival = arrive(received_us);
  auto& channel = lasers_[static_cast<std::size_t>(is_raw ? Laser::kRawSweep : Laser::kSweep)];
  LaserRecord* record = begun(channel, part);
  if (record == nullptr) {
    record = &channel.push({arrival, received_us, part.utime, part.revolution, 0, part.parts, 0});
  }
  record->arrival = arrival;
  ++record->parts_heard;
  record->points += part.points.size();
}

const ScanRecord* PoseBook::scan_of(const PoseRecord& pose) const {
  // The scan arrives shortly before its pose.
  auto one = std::ranges::partition_point(
      scans_, [&](const ScanRecord& scan) { return scan.arrival.order < pose.arrival.order; });
  while (one != scans_.begin()) {
    --one;
    if (one->utime == pose.pose.utime) return &*one;
  }
  return nullptr;
}

std::optional<double> PoseBook::latency_ms(const PoseRecord& pose) const {
  const std::int64_t received_us = pose.arrival.received_us;
  if (received_us == 0 || is_replayed()) return std::nullopt;
  if (is_same_clock(pose.pose.utime, received_us))
    return milliseconds(pose.pose.utime, received_us);
  const ScanRecord* const scan = scan_of(pose);
  if (scan == nullptr || scan->arrival.received_us == 0) return std::nullopt;
  return milliseconds(scan->arrival.received_us, received_us);
}

bool PoseBook::is_replayed() const {
  return 2 * poses_at_once_ > poses_.heard() || 2 * updates_at_once_ > updates_.heard();
}

}  // namespace understory::story
