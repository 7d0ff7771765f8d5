// Members of exchanged values in a saved state.
#pragma once

#include "common/model/ekf_output.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "common/model/place_scan.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/submap.hpp"
#include "common/model/tracked.hpp"
#include "common/model/view_ranges.hpp"
#include "common/model/wheels.hpp"
#include "common/state/archive.hpp"

namespace understory::model {

// Each function below lists the members of one type, for state::Writer and state::Reader.

/// Members of a saved ImuSample.
template <class Archive, class Self>
requires state::Is<Self, ImuSample>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.angular_rate_rad_s, s.specific_force_mps2);
}
/// Members of a saved WheelSample.
template <class Archive, class Self>
requires state::Is<Self, WheelSample>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.speed_mps, s.steering_rad); }
/// Members of a saved GnssFix.
template <class Archive, class Self>
requires state::Is<Self, GnssFix>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.east_north_m, s.sigma_m, s.velocity_mps, s.velocity_sigma_mps);
}
/// Members of a saved VelocityCorrection.
template <class Archive, class Self>
requires state::Is<Self, VelocityCorrection>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.velocity_mps, s.bias, s.covariance); }
/// Members of a saved PlanarScan.
template <class Archive, class Self>
requires state::Is<Self, PlanarScan>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.first_bearing_rad, s.bearing_step_rad, s.max_range_m, s.ranges_m,
    s.beam_interval_s, s.vehicle_T_sensor);
}
/// Members of a saved SweepPoint.
template <class Archive, class Self>
requires state::Is<Self, SweepPoint>
void archive(Archive& a, Self& s) { a(s.x_m, s.y_m, s.z_m, s.time_s, s.ring, s.intensity); }

/// Members of a saved Detection.
template <class Archive, class Self>
requires state::Is<Self, Detection>
void archive(Archive& a, Self& s) {
  a(s.position_m, s.covariance_m2, s.radius_m, s.kind, s.bearing_rad, s.bearing_sigma_rad);
}
/// Members of a saved FieldOfView.
template <class Archive, class Self>
requires state::Is<Self, FieldOfView>
void archive(Archive& a, Self& s) { a(s.max_range_m, s.bearing_rad, s.width_rad); }
/// Members of a saved LandmarkScan.
template <class Archive, class Self>
requires state::Is<Self, LandmarkScan>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.field_of_view, s.detections); }
/// Members of saved ViewRanges.
template <class Archive, class Self>
requires state::Is<Self, ViewRanges>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.sensor_m, s.turn_m, s.first_bearing_rad, s.step_rad, s.beam_step_rad,
    s.range_step_m, s.free, s.hidden);
}
/// Members of a saved PlaceScan.
template <class Archive, class Self>
requires state::Is<Self, PlaceScan>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.points); }
/// Members of a saved TrackedLandmark.
template <class Archive, class Self>
requires state::Is<Self, TrackedLandmark>
void archive(Archive& a, Self& s) { a(s.track_id, s.detection, s.observed); }
/// Members of a saved TrackedScan.
template <class Archive, class Self>
requires state::Is<Self, TrackedScan>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.field_of_view, s.landmarks); }

/// Members of a saved LevelError.
template <class Archive, class Self>
requires state::Is<Self, LevelError>
void archive(Archive& a, Self& s) { a(s.covariance, s.memory, s.added, s.pitch_tangent); }
/// Members of a saved Preintegration.
template <class Archive, class Self>
requires state::Is<Self, Preintegration>
void archive(Archive& a, Self& s) {
  a(s.seconds, s.yaw_rad, s.velocity_mps, s.position_m, s.covariance, s.bias_jacobian, s.bias,
    s.level);
}
/// Members of a saved Odometry.
template <class Archive, class Self>
requires state::Is<Self, Odometry>
void archive(Archive& a, Self& s) {
  a(s.from_utime, s.utime, s.sequence, s.from_T_to, s.covariance, s.inertial, s.has_wheels,
    s.is_stationary);
}

/// Members of a saved EkfPose.
template <class Archive, class Self>
requires state::Is<Self, EkfPose>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.ekf_map_T_vehicle, s.covariance, s.velocity_mps, s.velocity_covariance,
    s.bias, s.bias_covariance, s.landmarks_used, s.landmarks_refused, s.reset_counter);
}
/// Members of a saved RestLevel.
template <class Archive, class Self>
requires state::Is<Self, RestLevel>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.rest_from_utime, s.rest_utime, s.error_rad, s.covariance,
    s.change_covariance);
}
/// Members of a saved EkfLevel.
template <class Archive, class Self>
requires state::Is<Self, EkfLevel>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.error_rad, s.covariance, s.reported_covariance);
}

/// Members of a saved KeyframeLandmark.
template <class Archive, class Self>
requires state::Is<Self, KeyframeLandmark>
void archive(Archive& a, Self& s) {
  a(s.position_m, s.covariance_m2, s.radius_m, s.observation_count, s.kind);
}
/// Members of a saved KeyframeMember.
template <class Archive, class Self>
requires state::Is<Self, KeyframeMember>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.centre_T_vehicle, s.covariance); }
/// Members of a saved KeyframeDetection.
template <class Archive, class Self>
requires state::Is<Self, KeyframeDetection>
void archive(Archive& a, Self& s) { a(s.member, s.detection, s.landmark); }
/// Members of a saved Keyframe.
template <class Archive, class Self>
requires state::Is<Self, Keyframe>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.field_of_view, s.members, s.landmarks, s.previous_T_base, s.detections);
}
/// Members of a saved MapLandmark.
template <class Archive, class Self>
requires state::Is<Self, MapLandmark>
void archive(Archive& a, Self& s) {
  a(s.id, s.position_m, s.covariance_m2, s.radius_m, s.observation_count, s.kind);
}
/// Members of a saved Submap.
template <class Archive, class Self>
requires state::Is<Self, Submap>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.map_id, s.id, s.content_hash, s.map_T_submap, s.landmarks, s.keyframes,
    s.replaced, s.payload);
}
/// Members of a saved LoopEnd.
template <class Archive, class Self>
requires state::Is<Self, LoopEnd>
void archive(Archive& a, Self& s) { a(s.submap, s.keyframe); }
/// Members of a saved LoopClosure.
template <class Archive, class Self>
requires state::Is<Self, LoopClosure>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.map_id, s.id, s.source, s.is_revoked, s.from, s.to, s.from_T_to,
    s.log10_false_alarm);
}
/// Members of a saved MapCorrection.
template <class Archive, class Self>
requires state::Is<Self, MapCorrection>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.map_id, s.version, s.submaps); }
/// Members of a saved SubmapPose.
template <class Archive, class Self>
requires state::Is<Self, SubmapPose>
void archive(Archive& a, Self& s) { a(s.id, s.map_T_submap); }
/// Members of a saved KeyframePose.
template <class Archive, class Self>
requires state::Is<Self, KeyframePose>
void archive(Archive& a, Self& s) {
  a(s.keyframe_sequence, s.utime, s.map_T_vehicle, s.covariance);
}

}  // namespace understory::model
