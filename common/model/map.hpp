// The map, and its change by a keyframe.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// 64 bit: map id (upper 16), counter (lower 48). Permanent, never reused. 0 = none.
using LandmarkId = std::uint64_t;
/// Bits of a landmark id for the counter within its map.
inline constexpr unsigned kLandmarkCounterBits = 48;
/// Number of the map that assigned the id; 0 for none.
constexpr std::uint32_t map_of(LandmarkId id) {
  return static_cast<std::uint32_t>(id >> kLandmarkCounterBits);
}

/// One landmark of the map.
struct MapLandmark {
  LandmarkId id = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
  Eigen::Matrix2d covariance_m2 =
      Eigen::Matrix2d::Zero();          ///< Marginal, frame `map`; zero where not computed.
  double radius_m = 0.0;                ///< 0 where unknown.
  std::uint32_t observation_count = 0;  ///< Scans in which it was detected.
  LandmarkKind kind = LandmarkKind::kTrunk;
};

/// A keyframe's base pose in the map.
struct KeyframePose {
  std::uint64_t keyframe_sequence = 0;
  Utime utime = 0;
  geometry::SE2 map_T_vehicle;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m, rad; zero where not computed.
};

/// Result of a keyframe.
enum class MapUpdateStatus : std::uint8_t {
  kFirstMap = 0,  ///< It started the map; with a `map_id` above the last one, a new map beside it.
  kUpdated = 1,   ///< Localised and fused.
  kNotSure =
      2,  ///< No pose is significantly better than chance or the second best; nothing was changed.
  kRolledBack = 3,  ///< Fused, found inconsistent (chi^2), undone exactly.
  kRejected = 4,    ///< Malformed, empty, or out of order.
};

/// A keyframe's landmark and the same landmark of the map.
struct Association {
  std::uint32_t keyframe_landmark = 0;  ///< Index in Keyframe::landmarks.
  LandmarkId landmark_id = 0;
};

/// A scan of a keyframe.
struct ScanReference {
  Utime utime = 0;
  std::uint64_t sequence = 0;  ///< Sequence of the LANDMARKS message.
};

/// A detection and its landmark.
struct IdentifiedDetection {
  std::uint32_t scan = 0;       ///< Index in MapUpdate::scans.
  std::uint32_t detection = 0;  ///< Index in LandmarkScan::detections of that scan.
  LandmarkId landmark_id = 0;   ///< 0 = none: it is not in the map (yet).
};

/// Range measurement along the ray to a landmark that was not detected.
enum class LineOfSight : std::uint8_t {
  kUnknown = 0,  ///< Not certain, or no ranges.
  kBlocked = 1,  ///< An object stands in front of it or at its position.
  kClear = 2,    ///< Beams passed beyond its position.
};

/// An expected landmark that was not seen.
struct ExpectedLandmark {
  LandmarkId id = 0;
  LineOfSight sight = LineOfSight::kUnknown;

  friend bool operator==(const ExpectedLandmark&, const ExpectedLandmark&) = default;
};

/// Channels SLAM_UPDATE and SLAM_POSE, for one keyframe.
struct MapUpdate {
  std::uint64_t keyframe_sequence = 0;
  Utime utime = 0;
  MapUpdateStatus status = MapUpdateStatus::kRejected;
  std::uint32_t map_id = 1;  ///< The map in use; upper 16 bits of its landmarks' ids.
  /// Too few keyframes agree with the map so far: it may be dropped for another one.
  bool is_provisional = false;
  /// No pose is certain, and odometry has a gap since the last certain one.
  bool is_lost = false;
  geometry::SE2 map_T_vehicle;                           ///< Pose of the keyframe's base.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Covariance of map_T_vehicle; m, rad.
  geometry::SE2 map_T_latest_vehicle;                    ///< Pose of the keyframe's last member.
  std::vector<Association> associations;
  std::vector<LandmarkId> added;                          ///< Landmarks added by this keyframe.
  std::vector<LandmarkId> removed;                        ///< Landmarks removed by this keyframe.
  std::vector<std::pair<LandmarkId, LandmarkId>> merged;  ///< old -> new.
  // Seen and expected landmarks; empty where the keyframe has no pose.
  std::vector<ScanReference> scans;             ///< The keyframe's members.
  std::vector<IdentifiedDetection> detections;  ///< In order of scan and detection, each once.
  /// Unseen landmarks in the field of view of every scan, in order of id; at most the nearest 1000.
  std::vector<ExpectedLandmark> expected;
  // Diagnostics.
  bool used_prior = false;       ///< Localised by gating around the predicted pose, not by search.
  std::uint32_t candidates = 0;  ///< Hypotheses tried by the search.
  std::uint32_t inliers = 0;     ///< Associations of the accepted pose.
  double chi2 = 0.0;             ///< chi^2 of the innovation, with `degrees_of_freedom`.
  std::uint32_t degrees_of_freedom = 0;
  double log10_false_alarm = 0.0;  ///< Bound for the accepted pose (search only).
  std::string reason;  ///< Reason why it was not fused, or by odometry alone; else empty.
};

}  // namespace understory::model
