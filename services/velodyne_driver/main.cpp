// The Velodyne driver as a process: every channel that it touches, besides HEALTH, LOG, CONFIG.
#include "services/velodyne_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::velodyne_driver::velodyne_driver_service({
          .raw_sweep = "RAW_SWEEP",  // out: turns of the sensor, in parts; in: UDP, data port
          .raw_gnss = "RAW_GNSS",    // out: fixes of its receiver; in: UDP, position port
      }),
      argc, argv);
}
