// The Livox driver's process. Its channels: LivoxDriverChannels in adapter.hpp, and --help.
#include "services/livox_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::livox_driver::livox_driver_service(), argc, argv);
}
