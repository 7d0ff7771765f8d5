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

namespace understory::wire {

Result<model::LandmarkScan> from_wire(const landmarks_t& wire);
Result<model::Odometry> from_wire(const odometry_t& wire);
Result<model::Odometry> from_wire(const odometry2_t& wire);
Result<model::Keyframe> from_wire(const keyframe_t& wire);
Result<model::MapUpdate> from_wire(const slam_update_t& wire);
Result<model::SlamPose> from_wire(const slam_pose_t& wire);
Result<model::WholeMap> from_wire(const map_t& wire);
Result<model::MapDelta> from_wire(const map_delta_t& wire);
/// Where the laser sits and the intensities stay behind.
Result<model::PlanarScan> from_wire(const lidar_scan_t& wire);
Result<model::WheelSample> from_wire(const wheels_t& wire);
Result<model::ImuSample> from_wire(const imu_t& wire);
Result<model::PointSweep> from_wire(const lidar_sweep_t& wire);
Result<model::TrackedScan> from_wire(const tracked_landmarks_t& wire);
Result<model::RawPose> from_wire(const raw_pose_t& wire);
Result<model::EkfPose> from_wire(const ekf_pose_t& wire);
Result<model::EkfMap> from_wire(const ekf_map_t& wire);
Result<model::EkfLevel> from_wire(const ekf_level_t& wire);
Result<model::VelocityCorrection> from_wire(const velocity_correction_t& wire);
/// Refused where the receiver has no fix.
Result<model::GnssFix> from_wire(const gnss_t& wire);

landmarks_t to_wire(const model::LandmarkScan& scan);
odometry2_t to_wire(const model::Odometry& odometry);
keyframe_t to_wire(const model::Keyframe& keyframe);
slam_update_t to_wire(const model::MapUpdate& update);  ///< `seq` is the keyframe's.
slam_pose_t to_wire(const model::SlamPose& pose);
map_t to_wire(const model::WholeMap& map);
map_delta_t to_wire(const model::MapDelta& delta);
lidar_scan_t to_wire(const model::PlanarScan& scan);
wheels_t to_wire(const model::WheelSample& sample);
gnss_t to_wire(const model::GnssFix& fix);
imu_t to_wire(const model::ImuSample& sample);
/// Rounded to {1, 2, 4 ...} mm and us, as fine as 16 bits allow. Throws std::invalid_argument
/// where a coordinate is not finite.
lidar_sweep_t to_wire(const model::PointSweep& sweep);
tracked_landmarks_t to_wire(const model::TrackedScan& scan);
raw_pose_t to_wire(const model::RawPose& pose);
ekf_pose_t to_wire(const model::EkfPose& pose);
ekf_map_t to_wire(const model::EkfMap& map);
ekf_level_t to_wire(const model::EkfLevel& level);
velocity_correction_t to_wire(const model::VelocityCorrection& correction);

pose2_t to_wire(const geometry::SE2& pose);
geometry::SE2 from_wire(const pose2_t& pose);

/// The wire type of a value that stages exchange; a wire type is its own.
template <class T>
struct WireOf {
  using type = T;
};
template <>
struct WireOf<model::LandmarkScan> {
  using type = landmarks_t;
};
template <>
struct WireOf<model::Odometry> {
  using type = odometry2_t;
};
template <>
struct WireOf<model::Keyframe> {
  using type = keyframe_t;
};
template <>
struct WireOf<model::MapUpdate> {
  using type = slam_update_t;
};
template <>
struct WireOf<model::SlamPose> {
  using type = slam_pose_t;
};
template <>
struct WireOf<model::WholeMap> {
  using type = map_t;
};
template <>
struct WireOf<model::MapDelta> {
  using type = map_delta_t;
};
template <>
struct WireOf<model::PlanarScan> {
  using type = lidar_scan_t;
};
template <>
struct WireOf<model::WheelSample> {
  using type = wheels_t;
};
template <>
struct WireOf<model::GnssFix> {
  using type = gnss_t;
};
template <>
struct WireOf<model::ImuSample> {
  using type = imu_t;
};
template <>
struct WireOf<model::PointSweep> {
  using type = lidar_sweep_t;
};
template <>
struct WireOf<model::TrackedScan> {
  using type = tracked_landmarks_t;
};
template <>
struct WireOf<model::RawPose> {
  using type = raw_pose_t;
};
template <>
struct WireOf<model::EkfPose> {
  using type = ekf_pose_t;
};
template <>
struct WireOf<model::EkfMap> {
  using type = ekf_map_t;
};
template <>
struct WireOf<model::EkfLevel> {
  using type = ekf_level_t;
};
template <>
struct WireOf<model::VelocityCorrection> {
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
inline Result<model::Odometry> decode_message<model::Odometry>(
    std::span<const std::uint8_t> bytes) {
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

}  // namespace understory::wire
