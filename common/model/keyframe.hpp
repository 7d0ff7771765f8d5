// Local landmarks, de-noised from several scans: the keyframer's output to the mapper.
#pragma once

#include <optional>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// One landmark of a keyframe, in the frame of the keyframe's `centre`.
struct KeyframeLandmark {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `centre`.
  /// D: covariance from this landmark's own detections, independent between landmarks.
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  double radius_m = 0.0;                ///< 0 where unknown.
  std::uint16_t observation_count = 0;  ///< Number of detections in its estimate.
  LandmarkKind kind = LandmarkKind::kTrunk;
};

/// One scan that went into a keyframe.
struct KeyframeMember {
  Utime utime = 0;
  std::uint64_t sequence = 0;  ///< Sequence of the LANDMARKS message.
  geometry::SE2 centre_T_vehicle;
  /// Covariance of `centre_T_vehicle` (right perturbation; m, rad) from this scan's detections.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// A detection in a landmark of a keyframe.
struct KeyframeDetection {
  std::uint32_t member = 0;     ///< Index in Keyframe::members.
  std::uint32_t detection = 0;  ///< Index in LandmarkScan::detections of that scan.
  std::uint32_t landmark = 0;   ///< Index in Keyframe::landmarks.
};

/// Channel KEYFRAME.
///
/// The member scans and the local landmarks are estimated together. Landmarks are given in the
/// frame `centre`, in which their errors are independent (covariance D). The pose of the base (the
/// first member) in that frame has `Sigma_base`, the covariance of members[0]. In the base's frame
/// the landmarks' joint covariance is D + J Sigma_base J^T.
struct Keyframe {
  Utime utime = 0;                      ///< Stamp of the base scan.
  std::uint64_t sequence = 0;           ///< Counts keyframes.
  FieldOfView field_of_view;            ///< Field of view of the scans.
  std::vector<KeyframeMember> members;  ///< In order of time; members[0] is the base.
  std::vector<KeyframeLandmark> landmarks;
  /// Motion from the previous keyframe's base to this one, tracked by the keyframer; none after a
  /// gap. It is estimated from the same detections, so use it for gating and linearisation, never
  /// as a measurement.
  std::optional<geometry::SE2> previous_T_base;
  /// In order of member and detection, each once. Detections that are not listed are in no
  /// landmark; a keyframer of your own may list none.
  std::vector<KeyframeDetection> detections;

  /// Pose of the base. Precondition: `members` is not empty.
  const geometry::SE2& centre_T_base() const { return members.front().centre_T_vehicle; }
};

}  // namespace understory::model
