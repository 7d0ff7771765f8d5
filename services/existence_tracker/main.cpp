// The existence tracker as a process: every channel that it touches, besides HEALTH, LOG and
// CONFIG.
#include "services/existence_tracker/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::existence_tracker::existence_tracker_service({
          .slam_update = "SLAM_UPDATE",          // in: what was seen, and what was not
          .map = "MAP",                          // in: where the landmarks are
          .map_delta = "MAP_DELTA",              // in: likewise, what changed
          .existence = "EXISTENCE",              // out: probability of each landmark
          .existence_state = "EXISTENCE_STATE",  // out: what the next drive goes on with
          .map_request = "MAP_REQUEST",          // out: asks for MAP where landmarks are not known
      }),
      argc, argv);
}
