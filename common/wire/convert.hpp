// Converts between wire types and the values that stages exchange.
//
// `from_wire` takes a decoded message and checks values beyond the layout: ranges, kinds,
// covariances symmetric and positive semidefinite, consistent fields. `to_wire` cannot fail.
#pragma once

#include <type_traits>
#include <utility>

#include "common/model/ekf_output.hpp"
#include "common/model/existence.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "common/model/place_scan.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "common/model/tracked.hpp"
#include "common/model/view_ranges.hpp"
#include "common/model/wheels.hpp"
#include "common/wire/guard.hpp"
#include "common/wire/result.hpp"
#include "understory/ekf_level_t.hpp"
#include "understory/ekf_map_t.hpp"
#include "understory/ekf_pose_t.hpp"
#include "understory/existence_state_t.hpp"
#include "understory/existence_t.hpp"
#include "understory/gnss_t.hpp"
#include "understory/imu_t.hpp"
#include "understory/keyframe2_t.hpp"
#include "understory/keyframe_t.hpp"
#include "understory/landmarks_t.hpp"
#include "understory/lidar_scan_t.hpp"
#include "understory/lidar_sweep_t.hpp"
#include "understory/loop_closure2_t.hpp"
#include "understory/loop_closure_t.hpp"
#include "understory/loop_result_t.hpp"
#include "understory/map_correction_t.hpp"
#include "understory/map_delta_t.hpp"
#include "understory/map_t.hpp"
#include "understory/odometry2_t.hpp"
#include "understory/odometry_t.hpp"
#include "understory/place_scan_t.hpp"
#include "understory/raw_pose_t.hpp"
#include "understory/rest_level2_t.hpp"
#include "understory/rest_level_t.hpp"
#include "understory/slam_pose2_t.hpp"
#include "understory/slam_pose_t.hpp"
#include "understory/slam_update2_t.hpp"
#include "understory/slam_update3_t.hpp"
#include "understory/slam_update_t.hpp"
#include "understory/submap_query_t.hpp"
#include "understory/submap_stored_t.hpp"
#include "understory/submap_t.hpp"
#include "understory/tracked_landmarks_t.hpp"
#include "understory/velocity_correction_t.hpp"
#include "understory/view_ranges_t.hpp"
#include "understory/wheels_t.hpp"

namespace understory::wire {

/// A scan of detected landmarks, frame `vehicle_level`.
Result<model::LandmarkScan> from_wire(const landmarks_t& wire);
/// An odometry increment of logs written before odometry2_t: without the level's error.
Result<model::Odometry> from_wire(const odometry_t& wire);
/// An odometry increment between two stamps.
Result<model::Odometry> from_wire(const odometry2_t& wire);
/// A keyframe with its members, landmarks and detections.
Result<model::Keyframe> from_wire(const keyframe2_t& wire);
/// A keyframe of logs written before keyframe2_t: without detections.
Result<model::Keyframe> from_wire(const keyframe_t& wire);
/// Free ranges around the sensor.
Result<model::ViewRanges> from_wire(const view_ranges_t& wire);
/// Points for place recognition.
Result<model::PlaceScan> from_wire(const place_scan_t& wire);
/// A mapper's update for one keyframe.
Result<model::MapUpdate> from_wire(const slam_update3_t& wire);
/// The same from logs written before slam_update3_t: without lines of sight.
Result<model::MapUpdate> from_wire(const slam_update2_t& wire);
/// The same from logs written before slam_update2_t: map 1, without scans and detections.
Result<model::MapUpdate> from_wire(const slam_update_t& wire);
/// A mapper's pose at one scan.
Result<model::SlamPose> from_wire(const slam_pose2_t& wire);
/// The same from logs written before slam_pose2_t: map 1.
Result<model::SlamPose> from_wire(const slam_pose_t& wire);
/// A whole map.
Result<model::WholeMap> from_wire(const map_t& wire);
/// A change of a map.
Result<model::MapDelta> from_wire(const map_delta_t& wire);
/// A part of a map; refused where the hash does not match the payload.
Result<model::Submap> from_wire(const submap_t& wire);
/// Confirmation that a submap is on disk.
Result<model::SubmapStored> from_wire(const submap_stored_t& wire);
/// A request for submaps.
Result<model::SubmapQuery> from_wire(const submap_query_t& wire);
/// Poses of the submaps.
Result<model::MapCorrection> from_wire(const map_correction_t& wire);
/// A loop closure, or the revocation of one.
Result<model::LoopClosure> from_wire(const loop_closure2_t& wire);
/// The same from logs written before loop_closure2_t.
Result<model::LoopClosure> from_wire(const loop_closure_t& wire);
/// Result of a loop closure.
Result<model::LoopResult> from_wire(const loop_result_t& wire);
/// Existence of landmarks.
Result<model::Existence> from_wire(const existence_t& wire);
/// The existence tracker's saved state; refused where the hash does not match the bytes.
Result<model::ExistenceState> from_wire(const existence_state_t& wire);
/// A planar scan, without the laser's pose and the intensities.
Result<model::PlanarScan> from_wire(const lidar_scan_t& wire);
/// A reading of wheel encoder and steering sensor.
Result<model::WheelSample> from_wire(const wheels_t& wire);
/// A reading of the inertial unit.
Result<model::ImuSample> from_wire(const imu_t& wire);
/// A part of a sweep, coordinates in metres.
Result<model::PointSweep> from_wire(const lidar_sweep_t& wire);
/// A scan of landmarks with track ids.
Result<model::TrackedScan> from_wire(const tracked_landmarks_t& wire);
/// A dead-reckoned pose.
Result<model::RawPose> from_wire(const raw_pose_t& wire);
/// The filter's pose.
Result<model::EkfPose> from_wire(const ekf_pose_t& wire);
/// The filter's map.
Result<model::EkfMap> from_wire(const ekf_map_t& wire);
/// The filter's estimate of the level.
Result<model::EkfLevel> from_wire(const ekf_level_t& wire);
/// REST_LEVEL: the stationary interval must end after its begin and not after `utime`. In older
/// logs the covariance of the change equals that of the error.
Result<model::RestLevel> from_wire(const rest_level_t& wire);
Result<model::RestLevel> from_wire(const rest_level2_t& wire);
/// The filter's correction of velocity and biases.
Result<model::VelocityCorrection> from_wire(const velocity_correction_t& wire);
/// A satellite fix; refused where the receiver has no fix.
Result<model::GnssFix> from_wire(const gnss_t& wire);

/// A scan of detected landmarks.
landmarks_t to_wire(const model::LandmarkScan& scan);
/// An odometry increment.
odometry2_t to_wire(const model::Odometry& odometry);
/// A keyframe.
keyframe2_t to_wire(const model::Keyframe& keyframe);
/// A mapper's update for one keyframe, with the keyframe's `seq`.
slam_update3_t to_wire(const model::MapUpdate& update);
/// Free ranges around the sensor.
view_ranges_t to_wire(const model::ViewRanges& ranges);
/// Points for place recognition.
place_scan_t to_wire(const model::PlaceScan& scan);
/// A mapper's pose.
slam_pose2_t to_wire(const model::SlamPose& pose);
/// A whole map.
map_t to_wire(const model::WholeMap& map);
/// A change of a map.
map_delta_t to_wire(const model::MapDelta& delta);
/// A part of a map.
submap_t to_wire(const model::Submap& submap);
/// Confirmation that a submap is on disk.
submap_stored_t to_wire(const model::SubmapStored& stored);
/// A request for submaps.
submap_query_t to_wire(const model::SubmapQuery& query);
/// Poses of the submaps.
map_correction_t to_wire(const model::MapCorrection& correction);
/// A loop closure.
loop_closure2_t to_wire(const model::LoopClosure& closure);
/// Result of a loop closure.
loop_result_t to_wire(const model::LoopResult& result);
/// Existence of landmarks.
existence_t to_wire(const model::Existence& existence);
/// The existence tracker's saved state.
existence_state_t to_wire(const model::ExistenceState& state);
/// A planar scan.
lidar_scan_t to_wire(const model::PlanarScan& scan);
/// A reading of wheel encoder and steering sensor.
wheels_t to_wire(const model::WheelSample& sample);
/// A satellite fix.
gnss_t to_wire(const model::GnssFix& fix);
/// A reading of the inertial unit.
imu_t to_wire(const model::ImuSample& sample);
/// A part of a sweep, rounded to {1, 2, 4 ...} mm and us, as fine as 16 bits allow. Throws
/// std::invalid_argument where a coordinate is not finite.
lidar_sweep_t to_wire(const model::PointSweep& sweep);
/// A scan of landmarks with track ids.
tracked_landmarks_t to_wire(const model::TrackedScan& scan);
/// A dead-reckoned pose.
raw_pose_t to_wire(const model::RawPose& pose);
/// The filter's pose.
ekf_pose_t to_wire(const model::EkfPose& pose);
/// The filter's map.
ekf_map_t to_wire(const model::EkfMap& map);
/// The filter's estimate of the level.
ekf_level_t to_wire(const model::EkfLevel& level);
rest_level2_t to_wire(const model::RestLevel& level);
/// The filter's correction of velocity and biases.
velocity_correction_t to_wire(const model::VelocityCorrection& correction);

/// A pose [m, rad].
pose2_t to_wire(const geometry::SE2& pose);
/// A pose [m, rad], unchecked: call Checks::pose() before.
geometry::SE2 from_wire(const pose2_t& pose);

/// The wire type of a value is the result type of to_wire(); a wire type maps to itself.
template <class T>
struct WireOf {
  using type = T;  ///< The wire type.
};
/// For the values of common/model.
template <class T>
requires requires(const T& value) { to_wire(value); }
struct WireOf<T> {
  using type = decltype(to_wire(std::declval<const T&>()));  ///< The wire type.
};

/// Converts bytes to a value (or a wire type), with all checks.
template <class T>
Result<T> decode_message(std::span<const std::uint8_t> bytes) {
  using Wire = typename WireOf<T>::type;
  Result<Wire> wire = decode_bytes<Wire>(bytes);
  if constexpr (std::is_same_v<T, Wire>) {
    return wire;
  } else {
    if (!wire) return wire.refusal();
    return from_wire(*wire);
  }
}

/// The same for a value with older versions of its wire type in older logs; the newest first.
template <class T, class... Old>
Result<T> decode_either(std::span<const std::uint8_t> bytes) {
  const auto wire = decode_bytes<typename WireOf<T>::type>(bytes);
  if (wire) return from_wire(*wire);
  Result<T> result = wire.refusal();
  const auto is_of = [&]<class Version>(const Version* /*type*/) {
    const Result<Version> old = decode_bytes<Version>(bytes);
    if (old) result = from_wire(*old);
    return static_cast<bool>(old);
  };
  (void)(is_of(static_cast<const Old*>(nullptr)) || ...);
  return result;
}

/// Odometry: older logs have odometry_t.
template <>
inline Result<model::Odometry> decode_message<model::Odometry>(
    std::span<const std::uint8_t> bytes) {
  return decode_either<model::Odometry, odometry_t>(bytes);
}
/// The level at rest: older logs have rest_level_t.
template <>
inline Result<model::RestLevel> decode_message<model::RestLevel>(
    std::span<const std::uint8_t> bytes) {
  return decode_either<model::RestLevel, rest_level_t>(bytes);
}
/// Keyframes: older logs have keyframe_t.
template <>
inline Result<model::Keyframe> decode_message<model::Keyframe>(
    std::span<const std::uint8_t> bytes) {
  return decode_either<model::Keyframe, keyframe_t>(bytes);
}
/// Updates: older logs have slam_update2_t or slam_update_t.
template <>
inline Result<model::MapUpdate> decode_message<model::MapUpdate>(
    std::span<const std::uint8_t> bytes) {
  return decode_either<model::MapUpdate, slam_update2_t, slam_update_t>(bytes);
}
/// Poses: older logs have slam_pose_t.
template <>
inline Result<model::SlamPose> decode_message<model::SlamPose>(
    std::span<const std::uint8_t> bytes) {
  return decode_either<model::SlamPose, slam_pose_t>(bytes);
}

/// Loop closures: older logs have loop_closure_t.
template <>
inline Result<model::LoopClosure> decode_message<model::LoopClosure>(
    std::span<const std::uint8_t> bytes) {
  return decode_either<model::LoopClosure, loop_closure_t>(bytes);
}

/// Converts a value (or a wire type) to bytes.
template <class T>
Bytes encode_message(const T& value) {
  if constexpr (std::is_same_v<T, typename WireOf<T>::type>) {
    return encode_bytes(value);
  } else {
    return encode_bytes(to_wire(value));
  }
}

}  // namespace understory::wire
