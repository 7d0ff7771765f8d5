// Every channel that the viewer shows, in one list for live runs and logs.
#pragma once

#include <string>

#include "common/wire/convert.hpp"
#include "services/viewer/scene.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::viewer {

/// Properties of a channel.
struct ChannelTraits {
  bool is_bulk = false;            ///< Sweeps: received on request only.
  bool is_from_many = false;       ///< Several senders number their messages on it.
  bool is_on_message_time = true;  ///< Its stamps are those of the sensors.
};

/// Calls `visit.operator()<T>(channel, traits, take)` for each channel, with
/// take(scene, value, wall_us) for a value T of common/model, or a wire type.
template <class Visit>
void for_each_channel(Visit&& visit) {
  using std::int64_t;
  // The pose and the map.
  visit.template operator()<model::SlamPose>(
      "SLAM_POSE", {}, [](Scene& scene, const auto& one, int64_t us) { scene.take(one, us); });
  visit.template operator()<model::MapUpdate>(
      "SLAM_UPDATE", {}, [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::WholeMap>(
      "MAP", {}, [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::MapDelta>(
      "MAP_DELTA", {}, [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::Existence>(
      "EXISTENCE", {}, [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::Submap>(
      "SUBMAP", {}, [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::MapCorrection>(
      "MAP_CORRECTION", {}, [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::LoopClosure>(
      "LOOP_CLOSURE", {.is_from_many = true},
      [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::LoopResult>(
      "LOOP_RESULT", {}, [](Scene& scene, const auto& one, int64_t) { scene.take(one); });

  // Data of the sensors.
  visit.template operator()<model::LandmarkScan>(
      "LANDMARKS", {}, [](Scene& scene, const auto& one, int64_t us) { scene.take(one, us); });
  visit.template operator()<lidar_scan_t>(
      "LIDAR_SCAN", {}, [](Scene& scene, const lidar_scan_t& one, int64_t) {
        const auto scan = wire::from_wire(one);
        if (scan) scene.take(*scan, wire::from_wire(one.vehicle_T_sensor));
      });
  visit.template operator()<model::PointSweep>(
      "LIDAR_SWEEP", {.is_bulk = true},
      [](Scene& scene, const auto& one, int64_t) { scene.take(one); });
  visit.template operator()<model::Odometry>(
      "ODOMETRY", {},
      [](Scene& scene, const auto& one, int64_t us) { scene.take_stamp(one.utime, us); });

  // For stories and for Foxglove clients; not used by the scene.
  const auto pass_over = [](Scene& /*scene*/, const auto& /*one*/, int64_t) {};
  visit.template operator()<model::Keyframe>("KEYFRAME", {}, pass_over);
  visit.template operator()<model::TrackedScan>("TRACKED_LANDMARKS", {}, pass_over);
  visit.template operator()<model::EkfPose>("EKF_POSE", {}, pass_over);
  visit.template operator()<model::RawPose>("RAW_POSE", {}, pass_over);
  visit.template operator()<gnss_t>("GNSS", {}, pass_over);
  visit.template operator()<truth_landmarks_t>("TRUTH_LANDMARKS", {}, pass_over);

  // Ground truth, and the state of the processes.
  visit.template operator()<ground_truth_t>(
      "GROUND_TRUTH", {}, [](Scene& scene, const ground_truth_t& one, int64_t us) {
        scene.take_stamp(one.utime, us);
        scene.take_truth(one.utime, wire::from_wire(one.world_T_vehicle));
      });
  visit.template operator()<health_t>(
      "HEALTH", {.is_from_many = true, .is_on_message_time = false},
      [](Scene& scene, const health_t& one, int64_t us) { scene.take(one, us); });
  visit.template operator()<log_t>(
      "LOG", {.is_from_many = true, .is_on_message_time = false},
      [](Scene& scene, const log_t& one, int64_t) { scene.take(one); });
}

}  // namespace understory::viewer
