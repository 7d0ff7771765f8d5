// The loop closer as a process: every channel that it touches, besides HEALTH, LOG and CONFIG.
#include "services/loop_closer/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::loop_closer::loop_closer_service({
          .keyframe = "KEYFRAME",          // in: what was seen, to be recognised
          .place_scan = "PLACE_SCAN",      // in: clouds, where clouds are compared
          .slam_update = "SLAM_UPDATE",    // in: where the mapper placed it
          .submap = "SUBMAP",              // in: keyframes that the mapper has given away
          .loop_result = "LOOP_RESULT",    // in: what became of a closure
          .loop_closure = "LOOP_CLOSURE",  // out: a place found again, and how it lies
      }),
      argc, argv);
}
