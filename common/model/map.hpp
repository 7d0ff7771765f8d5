// The map, and what a keyframe changed in it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// 64 bit: map id (upper 16), counter (lower 48). Permanent, never used again. 0 = none.
using LandmarkId = std::uint64_t;
/// Bits of a landmark id that count within its map.
inline constexpr unsigned kLandmarkCounterBits = 48;
/// Number of the map that gave the id; 0 for none.
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

/// What became of a keyframe.
enum class MapUpdateStatus : std::uint8_t {
  kFirstMap =
      0,         ///< It started the map; with a `map_id` above the last one's, a new map beside it.
  kUpdated = 1,  ///< Localised and fused.
  kNotSure =
      2,  ///< No pose is significantly better than chance or the second best; nothing was changed.
  kRolledBack = 3,  ///< Fused, found inconsistent (chi^2), undone exactly.
  kRejected = 4,    ///< Malformed, empty, or out of order.
};

/// A keyframe's landmark and the landmark of the map that it is.
struct Association {
  std::uint32_t keyframe_landmark = 0;  ///< Index in Keyframe::landmarks.
  LandmarkId landmark_id = 0;
};

/// A scan that went into a keyframe.
struct ScanReference {
  Utime utime = 0;
  std::uint64_t sequence = 0;  ///< Of the LANDMARKS message.
};

/// A detection and the landmark that it is.
struct IdentifiedDetection {
  std::uint32_t scan = 0;       ///< Index in MapUpdate::scans.
  std::uint32_t detection = 0;  ///< Index in LandmarkScan::detections of that scan.
  LandmarkId landmark_id = 0;   ///< 0 = none: it is not in the map (yet).
};

/// What the sensor measured along the ray to a landmark that was not detected.
enum class LineOfSight : std::uint8_t {
  kUnknown = 0,  ///< Neither of both is certain, or there were no ranges.
  kBlocked = 1,  ///< Something stands in front of it, or there.
  kClear = 2,    ///< Beams went on behind its place.
};

/// A landmark that should have been seen and was not.
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
  std::uint32_t map_id = 1;  ///< Of the map in use; upper 16 bit of its landmarks' ids.
  /// Fewer keyframes than are wanted agree with the map so far: it may be dropped for another one.
  bool is_provisional = false;
  /// No pose is certain, and odometry does not reach here from the last certain one.
  bool is_lost = false;
  geometry::SE2 map_T_vehicle;                           ///< Of the keyframe's base.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of map_T_vehicle; m, rad.
  geometry::SE2 map_T_latest_vehicle;                    ///< Of the keyframe's last member.
  std::vector<Association> associations;
  std::vector<LandmarkId> added;                          ///< By this keyframe.
  std::vector<LandmarkId> removed;                        ///< By this keyframe.
  std::vector<std::pair<LandmarkId, LandmarkId>> merged;  ///< old -> new.
  // What was seen and what was not; empty where the keyframe has no place.
  std::vector<ScanReference> scans;             ///< Its members.
  std::vector<IdentifiedDetection> detections;  ///< In order of scan and detection, each once.
  /// Landmarks in the field of view of every scan that were not seen, in order of id; at most 1000,
  /// the nearest.
  std::vector<ExpectedLandmark> expected;
  // Diagnostics.
  bool used_prior = false;       ///< Localised by gating around the predicted pose, not by search.
  std::uint32_t candidates = 0;  ///< Hypotheses tried by the search.
  std::uint32_t inliers = 0;     ///< Associations that the accepted pose rests on.
  double chi2 = 0.0;             ///< Of the innovation, over `degrees_of_freedom`.
  std::uint32_t degrees_of_freedom = 0;
  double log10_false_alarm = 0.0;  ///< Of the accepted pose (search only).
  std::string reason;              ///< Why it was not fused, or by odometry alone; else empty.
};

}  // namespace understory::model
