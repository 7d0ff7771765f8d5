// The Livox driver as a process: every channel that it touches, besides HEALTH, LOG, CONFIG.
#include "services/livox_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::livox_driver::livox_driver_service({
          .raw_sweep = "RAW_SWEEP",  // out: sweeps of 0.1 s, in parts; in: UDP, points port
          .raw_imu = "RAW_IMU",      // out: samples of its IMU; in: UDP, imu port
      }),
      argc, argv);
}
