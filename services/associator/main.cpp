// The associator as a process: every channel that it touches, besides HEALTH, LOG and CONFIG.
#include "services/associator/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::associator::associator_service({
          .landmarks = "LANDMARKS",                  // in: detections of one sweep
          .odometry = "ODOMETRY",                    // in: motion, where there is any
          .filter_pose = "EKF_POSE",                 // in: the filter, one sweep behind
          .tracked_landmarks = "TRACKED_LANDMARKS",  // out: the consistent ones, with ids
      }),
      argc, argv);
}
