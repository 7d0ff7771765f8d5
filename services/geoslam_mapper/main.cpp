// The mapper as a process: every channel that it touches, besides HEALTH, LOG and CONFIG.
#include "services/geoslam_mapper/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::geoslam_mapper::geoslam_mapper_service({
          .keyframe = "KEYFRAME",              // in: local landmarks of n sweeps
          .landmarks = "LANDMARKS",            // in: every sweep, located at once
          .view_ranges = "VIEW_RANGES",        // in: how far each sweep saw
          .odometry = "ODOMETRY",              // in: motion, where there is any
          .rest_level = "REST_LEVEL",          // in: what motion showed of the level at rest
          .ekf_pose = "EKF_POSE",              // in: a gate; velocity without wheels
          .ekf_level = "EKF_LEVEL",            // in: error of the sweeps' level, likewise
          .map_request = "MAP_REQUEST",        // in: asks for MAP now
          .given_map = "GIVEN_MAP",            // in: a map to begin with
          .submap_stored = "SUBMAP_STORED",    // in: the store has what was handed over
          .submap_reply = "SUBMAP_REPLY",      // in: a submap that was asked for
          .loop_closure = "LOOP_CLOSURE",      // in: two places and how one lies to the other
          .existence = "EXISTENCE",            // in: landmarks that are taken for gone
          .slam_pose = "SLAM_POSE",            // out: the vehicle's pose at each sweep
          .slam_update = "SLAM_UPDATE",        // out: what became of each keyframe
          .map = "MAP",                        // out: the whole map, rarely and on request
          .map_delta = "MAP_DELTA",            // out: what changed, per keyframe
          .submap = "SUBMAP",                  // out: what lies far away, to be kept
          .submap_query = "SUBMAP_QUERY",      // out: asks for what comes near again
          .map_correction = "MAP_CORRECTION",  // out: where the submaps are
          .loop_result = "LOOP_RESULT",        // out: what became of a closure
      }),
      argc, argv);
}
