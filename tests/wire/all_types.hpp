// Every type of lcmtypes/, for tests that go over all of them.
#pragma once

#include <tuple>

#include "common/wire/convert.hpp"
#include "understory/config_t.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/health_t.hpp"
#include "understory/log_t.hpp"
#include "understory/map_request_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::test {

using AllTypes =
    std::tuple<association_t, channel_health_t, config_t, detection_t, ekf_landmark_t, ekf_level_t,
               ekf_map_t, ekf_pose_t, existence_state_t, existence_t, expected_landmark_t, gnss_t,
               ground_truth_t, health_t, identified_detection_t, imu_t, keyframe2_t,
               keyframe_detection_t, keyframe_landmark_t, keyframe_member_t, keyframe_pose_t,
               keyframe_t, landmark_existence_t, landmarks_t, lidar_scan_t, level_error_t,
               lidar_sweep_t, log_t, loop_closure2_t, loop_closure_t, loop_end_t, loop_result_t,
               map_correction_t, map_delta_t, map_landmark_t, map_request_t, map_t, merge_t,
               odometry2_t, odometry_t, place_scan_t, pose2_t, preintegration_t, raw_pose_t,
               reason_count_t, rest_level2_t, rest_level_t, scan_reference_t, slam_pose2_t,
               slam_pose_t, slam_update2_t, slam_update3_t, slam_update_t, submap_pose_t,
               submap_query_t, submap_stored_t, submap_t, tracked_landmark_t, tracked_landmarks_t,
               truth_landmark_t, truth_landmarks_t, velocity_correction_t, view_ranges_t, wheels_t>;

using AllValues =
    std::tuple<model::LandmarkScan, model::Odometry, model::Keyframe, model::MapUpdate,
               model::SlamPose, model::WholeMap, model::MapDelta, model::PlanarScan,
               model::WheelSample, model::GnssFix, model::ImuSample, model::PointSweep,
               model::TrackedScan, model::RawPose, model::EkfPose, model::EkfMap, model::EkfLevel,
               model::RestLevel, model::VelocityCorrection, model::Submap, model::SubmapStored,
               model::SubmapQuery, model::MapCorrection, model::LoopClosure, model::LoopResult,
               model::Existence, model::ExistenceState, model::ViewRanges, model::PlaceScan>;

/// Calls `f` with a null pointer to each type of the tuple.
template <class Tuple, class F>
void for_each_type(F f) {
  std::apply([&](auto*... types) { (f(types), ...); },
             []<class... T>(std::tuple<T...>*) {
               return std::tuple<T*...>{};
             }(static_cast<Tuple*>(nullptr)));
}

}  // namespace understory::test
