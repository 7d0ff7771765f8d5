// The landmark extractor as a process: every channel that it touches, besides HEALTH, LOG, CONFIG.
#include "services/landmark_extractor/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::landmark_extractor::landmark_extractor_service({
          .lidar_scan = "LIDAR_SCAN",    // in: scans of a planar laser
          .lidar_sweep = "LIDAR_SWEEP",  // in: sweeps in space, in parts
          .landmarks = "LANDMARKS",      // out: trunks and corners of each sweep
          .view_ranges = "VIEW_RANGES",  // out: how far each sweep saw at the height of trunks
          .place_scan = "PLACE_SCAN",    // out: clouds for loop detectors that compare clouds
      }),
      argc, argv);
}
