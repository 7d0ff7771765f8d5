// The filter as a process: every channel that it touches, besides HEALTH, LOG and CONFIG.
#include "services/ekf/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::ekf::ekf_service({
          .odometry = "ODOMETRY",                        // in: motion without landmarks
          .tracked_landmarks = "TRACKED_LANDMARKS",      // in: consistent landmarks of a sweep
          .raw_pose = "RAW_POSE",                        // in: dead reckoning, for gaps
          .pose = "EKF_POSE",                            // out: pose, velocity, biases
          .map = "EKF_MAP",                              // out: landmarks of the active state
          .level = "EKF_LEVEL",                          // out: error of the sweeps' level
          .velocity_correction = "VELOCITY_CORRECTION",  // out: velocity and biases for the input
      }),
      argc, argv);
}
