// The Velodyne driver's process. Its channels: VelodyneDriverChannels in adapter.hpp, and --help.
#include "services/velodyne_driver/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::velodyne_driver::velodyne_driver_service(), argc,
                                      argv);
}
