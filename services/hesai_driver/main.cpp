// The Hesai driver as a process: every channel that it touches, besides HEALTH, LOG, CONFIG.
#include "services/hesai_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::hesai_driver::hesai_driver_service({
          .raw_sweep = "RAW_SWEEP",  // out: turns of the sensor, in parts; in: UDP, data port
      }),
      argc, argv);
}
