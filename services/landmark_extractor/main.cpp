// The landmark extractor as a process: every channel that it touches, besides HEALTH, LOG, CONFIG.
#include "services/landmark_extractor/adapter.hpp"

int main(int argc, char** argv) {
  return understory::run_service(understory::landmark_extractor_service({
                                     .lidar_scan = "LIDAR_SCAN",  // in: sweeps of a planar laser
                                     .landmarks = "LANDMARKS",    // out: the trunks of each sweep
                                 }),
                                 argc, argv);
}
