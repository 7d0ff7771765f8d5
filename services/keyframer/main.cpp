// The keyframer as a process: every channel that it touches, besides HEALTH, LOG and CONFIG.
#include "services/keyframer/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::keyframer::keyframer_service({
          .landmarks = "LANDMARKS",  // in: detections of one sweep
          .odometry = "ODOMETRY",    // in: motion, where there is any
          .ekf_level = "EKF_LEVEL",  // in: error of roll and pitch, where a filter runs
          .keyframe = "KEYFRAME",    // out: local landmarks of n sweeps
      }),
      argc, argv);
}
