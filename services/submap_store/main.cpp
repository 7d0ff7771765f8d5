// The store as a process: every channel that it touches, besides HEALTH, LOG and CONFIG.
#include "services/submap_store/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::submap_store::submap_store_service({
          .submap = "SUBMAP",                    // in: a part of the map, to be kept
          .submap_query = "SUBMAP_QUERY",        // in: asks for such parts
          .map_correction = "MAP_CORRECTION",    // in: where the submaps are
          .map = "MAP",                          // in: all that the mapper holds itself
          .map_delta = "MAP_DELTA",              // in: what changed in that
          .slam_update = "SLAM_UPDATE",          // in: its keyframes
          .loop_closure = "LOOP_CLOSURE",        // in: two places and how one lies to the other
          .loop_result = "LOOP_RESULT",          // in: what the mapper made of that
          .existence_state = "EXISTENCE_STATE",  // in: what the existence tracker goes on with
          .submap_stored = "SUBMAP_STORED",      // out: a submap is on the disk
          .submap_reply = "SUBMAP_REPLY",        // out: a submap that was asked for
          .map_request = "MAP_REQUEST",          // out: asks for MAP where changes were missed
      }),
      argc, argv);
}
