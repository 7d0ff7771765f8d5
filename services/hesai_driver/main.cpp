// The Hesai driver's process. Its channels: HesaiDriverChannels in adapter.hpp, and --help.
#include "services/hesai_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::hesai_driver::hesai_driver_service(), argc, argv);
}
