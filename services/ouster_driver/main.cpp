// The Ouster driver as a process: every channel that it touches, besides HEALTH, LOG, CONFIG.
#include "services/ouster_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::ouster_driver::ouster_driver_service({
          .raw_sweep = "RAW_SWEEP",  // out: frames, in parts; in: UDP, lidar port
          .raw_imu = "RAW_IMU",      // out: samples of its IMU; in: UDP, imu port
      }),
      argc, argv);
}
