// The Ouster driver's process. Its channels: OusterDriverChannels in adapter.hpp, and --help.
#include "services/ouster_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::ouster_driver::ouster_driver_service(), argc,
                                      argv);
}
