// Wire types <-> the values that stages exchange.
//
// `from_wire` takes a decoded message and checks what a layout cannot: ranges, kinds, covariances
// symmetric and positive semidefinite, fields that agree. `to_wire` cannot fail.
#pragma once

#include "common/model/ekf_output.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/tracked.hpp"
#include "common/model/wheels.hpp"
#include "common/wire/guard.hpp"
#include "common/wire/result.hpp"
#include "understory/ekf_level_t.hpp"
#include "understory/ekf_map_t.hpp"
#include "understory/ekf_pose_t.hpp"
#include "understory/gnss_t.hpp"
#include "understory/imu_t.hpp"
#include "understory/keyframe_t.hpp"
#include "understory/landmarks_t.hpp"
#include "understory/lidar_scan_t.hpp"
#include "understory/lidar_sweep_t.hpp"
#include "understory/map_delta_t.hpp"
#include "understory/map_t.hpp"
#include "understory/odometry2_t.hpp"
#include "understory/odometry_t.hpp"
#include "understory/raw_pose_t.hpp"
#include "understory/slam_pose_t.hpp"
#include "understory/slam_update_t.hpp"
#include "understory/tracked_landmarks_t.hpp"
#include "understory/velocity_correction_t.hpp"
#include "understory/wheels_t.hpp"

namespace understory {

Result<LandmarkScan> from_wire(const landmarks_t& wire);
Result<Odometry> from_wire(const odometry_t& wire);
Result<Odometry> from_wire(const odometry2_t& wire);
Result<Keyframe> from_wire(const keyframe_t& wire);
Result<MapUpdate> from_wire(const slam_update_t& wire);
Result<SlamPose> from_wire(const slam_pose_t& wire);
Result<WholeMap> from_wire(const map_t& wire);
Result<MapDelta> from_wire(const map_delta_t& wire);
/// Where the laser sits and the intensities stay behind.
Result<PlanarScan> from_wire(const lidar_scan_t& wire);
Result<WheelSample> from_wire(const wheels_t& wire);
Result<ImuSample> from_wire(const imu_t& wire);
Result<PointSweep> from_wire(const lidar_sweep_t& wire);
Result<TrackedScan> from_wire(const tracked_landmarks_t& wire);
Result<RawPose> from_wire(const raw_pose_t& wire);
Result<EkfPose> from_wire(const ekf_pose_t& wire);
Result<EkfMap> from_wire(const ekf_map_t& wire);
Result<EkfLevel> from_wire(const ekf_level_t& wire);
Result<VelocityCorrection> from_wire(const velocity_correction_t& wire);
/// Refused where the receiver has no fix.
Result<GnssFix> from_wire(const gnss_t& wire);

landmarks_t to_wire(const LandmarkScan& scan);
odometry2_t to_wire(const Odometry& odometry);
keyframe_t to_wire(const Keyframe& keyframe);
slam_update_t to_wire(const MapUpdate& update);  ///< `seq` is the keyframe's.
slam_pose_t to_wire(const SlamPose& pose);
map_t to_wire(const WholeMap& map);
map_delta_t to_wire(const MapDelta& delta);
lidar_scan_t to_wire(const PlanarScan& scan);
wheels_t to_wire(const WheelSample& sample);
gnss_t to_wire(const GnssFix& fix);
imu_t to_wire(const ImuSample& sample);
/// Rounded to {1, 2, 4 ...} mm and us, as fine as 16 bits allow. Throws std::invalid_argument
/// where a coordinate is not finite.
lidar_sweep_t to_wire(const PointSweep& sweep);
tracked_landmarks_t to_wire(const TrackedScan& scan);
raw_pose_t to_wire(const RawPose& pose);
ekf_pose_t to_wire(const EkfPose& pose);
ekf_map_t to_wire(const EkfMap& map);
ekf_level_t to_wire(const EkfLevel& level);
velocity_correction_t to_wire(const VelocityCorrection& correction);

pose2_t to_wire(const SE2& pose);
SE2 from_wire(const pose2_t& pose);

/// The wire type of a value that stages exchange; a wire type is its own.
template <class T>
struct WireOf {
  using type = T;
};
template <>
struct WireOf<LandmarkScan> {
  using type = landmarks_t;
};
template <>
struct WireOf<Odometry> {
  using type = odometry2_t;
};
template <>
struct WireOf<Keyframe> {
  using type = keyframe_t;
};
template <>
struct WireOf<MapUpdate> {
  using type = slam_update_t;
};
template <>
struct WireOf<SlamPose> {
  using type = slam_pose_t;
};
template <>
struct WireOf<WholeMap> {
  using type = map_t;
};
template <>
struct WireOf<MapDelta> {
  using type = map_delta_t;
};
template <>
struct WireOf<PlanarScan> {
  using type = lidar_scan_t;
};
template <>
struct WireOf<WheelSample> {
  using type = wheels_t;
};
template <>
struct WireOf<GnssFix> {
  using type = gnss_t;
};
template <>
struct WireOf<ImuSample> {
  using type = imu_t;
};
template <>
struct WireOf<PointSweep> {
  using type = lidar_sweep_t;
};
template <>
struct WireOf<TrackedScan> {
  using type = tracked_landmarks_t;
};
template <>
struct WireOf<RawPose> {
  using type = raw_pose_t;
};
template <>
struct WireOf<EkfPose> {
  using type = ekf_pose_t;
};
template <>
struct WireOf<EkfMap> {
  using type = ekf_map_t;
};
template <>
struct WireOf<EkfLevel> {
  using type = ekf_level_t;
};
template <>
struct WireOf<VelocityCorrection> {
  using type = velocity_correction_t;
};

/// Bytes to a value (or a wire type), with every check there is.
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

/// Logs may have the version of before, which says nothing of the level's error.
template <>
inline Result<Odometry> decode_message<Odometry>(std::span<const std::uint8_t> bytes) {
  const Result<odometry2_t> wire = decode_bytes<odometry2_t>(bytes);
  if (wire) return from_wire(*wire);
  const Result<odometry_t> old = decode_bytes<odometry_t>(bytes);
  if (old) return from_wire(*old);
  return wire.refusal();
}

/// A value (or a wire type) to bytes.
template <class T>
Bytes encode_message(const T& value) {
  if constexpr (std::is_same_v<T, typename WireOf<T>::type>) {
    return encode_bytes(value);
  } else {
    return encode_bytes(to_wire(value));
  }
}

}  // namespace understory
