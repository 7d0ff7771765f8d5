// The messages from which poses were made.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/odometry.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "common/model/tracked.hpp"
#include "common/story/limits.hpp"
#include "common/story/ring.hpp"

namespace understory::story {

/// Arrival of a message.
struct Arrival {
  std::int64_t received_us = 0;  ///< Wall clock; 0 = unknown.
  std::uint64_t order = 0;       ///< Running number over all messages.
};

/// A SLAM_POSE.
struct PoseRecord {
  Arrival arrival;
  model::SlamPose pose;
};

/// A SLAM_UPDATE, its lists as numbers of entries.
struct UpdateRecord {
  Arrival arrival;
  model::Utime utime = 0;
  std::uint64_t keyframe = 0;
  model::MapUpdateStatus status = model::MapUpdateStatus::kRejected;
  bool is_lost = false;
  bool used_prior = false;
  std::uint32_t candidates = 0;
  std::uint32_t inliers = 0;
  std::uint32_t associations = 0;
  std::uint32_t added = 0;
  std::uint32_t merged = 0;
  std::uint32_t removed = 0;
  std::uint32_t expected = 0;
  std::uint32_t degrees_of_freedom = 0;
  double chi2 = 0.0;
  double log10_false_alarm = 0.0;
  std::string reason;  ///< The first 200 bytes.
};

/// A KEYFRAME.
struct KeyframeRecord {
  Arrival arrival;
  model::Utime utime = 0;
  std::uint64_t keyframe = 0;
  std::size_t landmarks = 0;
  std::size_t members = 0;
  std::vector<model::Utime> scans;  ///< The first 64 members.
};

/// A LANDMARKS or TRACKED_LANDMARKS.
struct ScanRecord {
  Arrival arrival;
  model::Utime utime = 0;
  std::uint64_t sequence = 0;
  std::size_t landmarks = 0;
};

/// An ODOMETRY.
struct MotionRecord {
  Arrival arrival;
  model::Utime from_utime = 0;
  model::Utime utime = 0;
  geometry::SE2 from_T_to;
  bool has_wheels = false;
  bool has_inertial = false;
  bool is_stationary = false;
};

/// An EKF_POSE.
struct FilterRecord {
  Arrival arrival;
  model::Utime utime = 0;
  double sigma_m = 0.0;  ///< Largest sigma of its position.
  std::uint32_t landmarks_used = 0;
  std::uint32_t landmarks_refused = 0;
};

/// A revolution of a laser; its parts are merged.
struct LaserRecord {
  Arrival arrival;  ///< Arrival of the last part.
  std::int64_t first_received_us = 0;
  model::Utime utime = 0;
  std::uint64_t revolution = 0;
  std::uint32_t parts_heard = 0;
  std::uint32_t parts = 1;
  std::size_t points = 0;  ///< Returns; beams of a scan.
};

/// A MAP_CORRECTION.
struct CorrectionRecord {
  Arrival arrival;
  model::Utime utime = 0;
  std::uint64_t version = 0;
  std::size_t submaps = 0;
};

/// The latest messages of all these channels. Each message costs O(1).
class PoseBook {
 public:
  /// The channels of lasers.
  enum class Laser : std::uint8_t { kRawScan, kRawSweep, kScan, kSweep };
  static constexpr std::size_t kLasers = 4;

  /// Stores as many messages as `limits` allow.
  explicit PoseBook(const Limits& limits);

  void take(const model::SlamPose& pose, std::int64_t received_us);
  void take(const model::MapUpdate& update, std::int64_t received_us);
  void take(const model::Keyframe& keyframe, std::int64_t received_us);
  void take(const model::LandmarkScan& scan, std::int64_t received_us);
  void take(const model::TrackedScan& scan, std::int64_t received_us);
  void take(const model::Odometry& odometry, std::int64_t received_us);
  void take(const model::EkfPose& pose, std::int64_t received_us);
  void take(const model::MapCorrection& correction, std::int64_t received_us);
  void take(const model::PlanarScan& scan, bool is_raw, std::int64_t received_us);
  void take(const model::PointSweep& part, bool is_raw, std::int64_t received_us);

  const History<PoseRecord>& poses() const { return poses_; }
  const History<UpdateRecord>& updates() const { return updates_; }
  const History<KeyframeRecord>& keyframes() const { return keyframes_; }
  const History<ScanRecord>& scans() const { return scans_; }
  const History<ScanRecord>& tracked() const { return tracked_; }
  const History<MotionRecord>& motions() const { return motions_; }
  const History<FilterRecord>& filter_poses() const { return filter_poses_; }
  const History<CorrectionRecord>& corrections() const { return corrections_; }
  const History<LaserRecord>& laser(Laser channel) const {
    return lasers_[static_cast<std::size_t>(channel)];
  }

  /// The scan of a pose; null if it was not received or was dropped. O(log(stored)) if it arrived
  /// shortly before, else O(stored).
  const ScanRecord* scan_of(const PoseRecord& pose) const;
  /// Time from the sensor's stamp to the pose if their clocks agree, else from LANDMARKS to the
  /// pose [ms]; none where times are unknown. Usually O(log(stored scans)).
  std::optional<double> latency_ms(const PoseRecord& pose) const;
  /// Whether reception times are meaningless: in a replay all messages derived from one input have
  /// the same one.
  bool is_replayed() const;

  std::size_t bytes() const;                             ///< Approximate memory held now [bytes].
  static std::size_t fixed_bytes(const Limits& limits);  ///< Upper limit of the memory [bytes].

 private:
  Arrival arrive(std::int64_t received_us);

  History<PoseRecord> poses_;
  History<UpdateRecord> updates_;
  History<KeyframeRecord> keyframes_;
  History<ScanRecord> scans_;
  History<ScanRecord> tracked_;
  History<MotionRecord> motions_;
  History<FilterRecord> filter_poses_;
  History<CorrectionRecord> corrections_;
  std::vector<History<LaserRecord>> lasers_;
  std::uint64_t order_ = 0;
  std::int64_t last_received_us_ = 0;
  std::uint64_t poses_at_once_ = 0;    ///< Poses with the reception time of the previous message.
  std::uint64_t updates_at_once_ = 0;  ///< Updates with the reception time of the previous message.
};

/// Milliseconds from one receive time or stamp to another [us].
double milliseconds(std::int64_t from_us, std::int64_t to_us);
/// Whether a stamp may belong to the clock of reception: at most a minute earlier.
bool is_same_clock(model::Utime stamp, std::int64_t received_us);
/// Largest standard deviation of the position [m].
double largest_sigma_m(const Eigen::Matrix3d& covariance);

}  // namespace understory::story
