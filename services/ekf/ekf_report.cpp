#include "services/ekf/ekf_report.hpp"

#include <algorithm>

#include "services/ekf/state_covariances.hpp"

namespace understory::ekf {
namespace {

/// The pose, without counts and without the scale's error.
model::EkfPose pose_of(const FilterState& state, double pitch_tangent) {
  model::EkfPose out;
  const geometry::SE2 pose = vehicle_pose(state);
  const double rotated = pitch_tangent * state.level.x();
  out.ekf_map_T_vehicle =
      geometry::SE2(pose.x(), pose.y(), geometry::wrap_angle(pose.theta() - rotated));
  out.covariance = pose_covariance(state, pitch_tangent);

  const Eigen::Matrix<double, 5, 5> motion = velocity_covariance(state);
  out.velocity_mps = rotation_of(state.heading).transpose() * state.velocity;
  out.velocity_covariance = motion.topLeftCorner<2, 2>();
  out.bias = state.bias;
  out.bias_covariance = motion.bottomRightCorner<3, 3>();
  return out;
}

SoundPose sound_pose(const model::EkfPose& pose) {
  return {pose.ekf_map_T_vehicle, pose.covariance, pose.bias};
}

model::VelocityCorrection correction_of(const FilterState& state, const model::EkfPose& pose) {
  model::VelocityCorrection correction;
  correction.utime = pose.utime;
  correction.velocity_mps = pose.velocity_mps;
  correction.bias = state.bias;
  correction.covariance = velocity_covariance(state);
  return correction;
}

}  // namespace

EkfOutput EkfReport::pose(const FilterState& state, const VehicleMotion& motion, model::Utime now,
                          const ScanUpdate& update) {
  EkfOutput output;
  model::EkfPose& pose = output.pose.emplace(pose_of(state, motion.pitch_tangent()));
  pose.utime = now;
  pose.landmarks_used = update.used;
  pose.landmarks_refused = update.refused;
  pose.reset_counter = reset_counter_;
  last_sound_ = sound_pose(pose);

  const Eigen::Vector2d scaled = pose.ekf_map_T_vehicle.inverse().translation() * scale_sigma_;
  pose.covariance.topLeftCorner<2, 2>() += scaled * scaled.transpose();
  pose.covariance += sweep_level_.pose_covariance();

  if (const auto& level_covariance = motion.level_covariance()) {
    output.level = model::EkfLevel{now, 0, state.level,
                                   state.covariance_block<2, 2>(kLevel, kLevel), *level_covariance};
  }
  return output;
}

EkfOutput EkfReport::all(const FilterState& state, const VehicleMotion& motion, model::Utime now,
                         const ScanUpdate& update) {
  EkfOutput output = pose(state, motion, now, update);
  output.map = map(state, now);
  output.correction = correction_of(state, *output.pose);
  return output;
}

void EkfReport::begin(const FilterState& state, const VehicleMotion& motion) {
  last_sound_ = sound_pose(pose_of(state, motion.pitch_tangent()));
}

model::EkfMap EkfReport::map(const FilterState& state, model::Utime now) {
  model::EkfMap map;
  map.utime = now;

  const auto& landmarks = state.landmarks();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const MapLandmark& landmark = landmarks[i];
    if (landmark.is_ground_mark()) continue;
    const Eigen::Vector2d position = landmark.position + state.anchor_m;
    const Eigen::Vector2d scaled = position * scale_sigma_;
    map.landmarks.push_back({landmark.id, position,
                             landmark_covariance(state, i) + scaled * scaled.transpose(),
                             landmark.radius_m, landmark.kind, landmark.observation_count});
  }
  std::ranges::sort(map.landmarks, {}, &model::EkfLandmark::track_id);
  return map;
}

}  // namespace understory::ekf
